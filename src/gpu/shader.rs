//! Shaders put together: shared parts imported once, constants of the Rust side in front, lines traced back.

use std::fmt;

/// The shader files, by the names under which they are imported.
const FILES: [(&str, &str); 6] = [
    ("terrain.wgsl", include_str!("../../shaders/terrain.wgsl")),
    ("closer.wgsl", include_str!("../../shaders/closer.wgsl")),
    ("sky.wgsl", include_str!("../../shaders/sky.wgsl")),
    (
        "shared/surface.wgsl",
        include_str!("../../shaders/shared/surface.wgsl"),
    ),
    (
        "shared/ground.wgsl",
        include_str!("../../shaders/shared/ground.wgsl"),
    ),
    (
        "shared/shade.wgsl",
        include_str!("../../shaders/shared/shade.wgsl"),
    ),
];

/// The name of what [`crate::shade::wgsl_constants`] puts in front of every shader.
const PRELUDE: &str = "constants";

/// The files that are whole shaders, not parts of others.
pub fn entry_files() -> impl Iterator<Item = &'static str> {
    FILES
        .into_iter()
        .map(|(name, _)| name)
        .filter(|name| !name.starts_with("shared/"))
}

/// A shader's whole text, with the origin of each line.
#[derive(Clone, Debug)]
pub struct Composed {
    /// WGSL.
    pub source: String,
    lines: Vec<(String, u32)>,
}

impl Composed {
    /// The file and line from which line `line` (from 1) of the whole text came.
    pub fn origin(&self, line: usize) -> Option<(&str, u32)> {
        self.lines
            .get(line.checked_sub(1)?)
            .map(|(file, line)| (file.as_str(), *line))
    }
}

/// An import that cannot be followed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShaderError {
    /// The file that imports.
    pub file: String,
    /// Its line, from 1.
    pub line: u32,
    /// What is wrong.
    pub what: String,
}

impl fmt::Display for ShaderError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: {}", self.file, self.line, self.what)
    }
}

impl std::error::Error for ShaderError {}

/// The whole text of `text`, a shader called `name`: a line `#import FILE` is replaced by that file, each file once.
///
/// # Errors
/// An import that is malformed or unknown, with its place.
pub fn compose(name: &str, text: &str) -> Result<Composed, ShaderError> {
    let mut composed = Composed {
        source: String::new(),
        lines: Vec::new(),
    };
    append(
        &mut composed,
        PRELUDE,
        &crate::shade::wgsl_constants(),
        &mut vec![],
    )?;
    append(&mut composed, name, text, &mut vec![name.to_string()])?;
    Ok(composed)
}

/// The whole text of one of this crate's own shaders.
///
/// # Panics
/// If the shader is unknown or its imports cannot be followed, which a test rules out for all of [`entry_files`].
pub(super) fn module(device: &wgpu::Device, name: &str) -> wgpu::ShaderModule {
    let (_, text) = FILES
        .into_iter()
        .find(|(file, _)| *file == name)
        .expect("the shader is one of FILES");
    let composed = compose(name, text).expect("a test composes every entry file");
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(&format!("clipscape {name}")),
        source: wgpu::ShaderSource::Wgsl(composed.source.into()),
    })
}

fn append(out: &mut Composed, file: &str, text: &str, seen: &mut Vec<String>) -> Result<(), ShaderError> {
    for (line, number) in text.lines().zip(1..) {
        let error = |what: String| ShaderError {
            file: file.to_string(),
            line: number,
            what,
        };
        let Some(rest) = line.trim_start().strip_prefix('#') else {
            out.source.push_str(line);
            out.source.push('\n');
            out.lines.push((file.to_string(), number));
            continue;
        };
        let import = rest.strip_prefix("import ").map(str::trim);
        let import = import.ok_or_else(|| error(format!("expected `#import FILE`, found `{line}`")))?;
        if seen.iter().any(|s| s == import) {
            continue;
        }
        seen.push(import.to_string());
        let known = FILES.into_iter().find(|(name, _)| *name == import);
        let (name, text) = known.ok_or_else(|| error(format!("there is no shader file `{import}`")))?;
        append(out, name, text, seen)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn imports_are_followed_once_and_lines_traced_back() {
        let text = "#import shared/shade.wgsl\nfn mine() {}\n#import shared/shade.wgsl\n";
        let composed = compose("test.wgsl", text).unwrap();
        assert_eq!(composed.source.matches("struct ShadeConstants").count(), 1);
        let line = composed.source.lines().position(|l| l == "fn mine() {}").unwrap() + 1;
        assert_eq!(composed.origin(line), Some(("test.wgsl", 2)));
        let line = composed
            .source
            .lines()
            .position(|l| l.starts_with("struct ShadeConstants"))
            .unwrap()
            + 1;
        assert_eq!(composed.origin(line).unwrap().0, "shared/shade.wgsl");
        assert_eq!(composed.origin(0), None);
    }

    #[test]
    fn imports_that_lead_nowhere_are_errors_with_their_place() {
        let error = compose("test.wgsl", "// a comment\n#import shared/none.wgsl\n").unwrap_err();
        assert_eq!(
            error.to_string(),
            "test.wgsl:2: there is no shader file `shared/none.wgsl`"
        );
        let error = compose("test.wgsl", "#include x\n").unwrap_err();
        assert_eq!(
            error.to_string(),
            "test.wgsl:1: expected `#import FILE`, found `#include x`"
        );
    }
}
