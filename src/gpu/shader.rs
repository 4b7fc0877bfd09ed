//! Shaders put together: shared parts imported once, constants of the Rust side in front, lines traced back.
//!
//! Two parts are not files. `view colour` calls the function of the view that is asked for; `surface function` is the
//! caller's own, where there is one, else `shared/look.wgsl`.

use std::fmt;

use crate::error::{Error, ErrorKind, Result};
use crate::shade::ViewMode;

/// The shader files, by the names under which they are imported.
const FILES: [(&str, &str); 9] = [
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
        "shared/point.wgsl",
        include_str!("../../shaders/shared/point.wgsl"),
    ),
    (
        "shared/views.wgsl",
        include_str!("../../shaders/shared/views.wgsl"),
    ),
    ("shared/look.wgsl", include_str!("../../shaders/shared/look.wgsl")),
    (
        "shared/shade.wgsl",
        include_str!("../../shaders/shared/shade.wgsl"),
    ),
];

/// The name of what [`crate::shade::wgsl_constants`] puts in front of every shader.
const PRELUDE: &str = "constants";

/// The part that calls the function of a view.
const VIEW_COLOUR: &str = "view colour";

/// The part that colours a point of the ground.
const SURFACE_FUNCTION: &str = "surface function";

/// What is put together into a shader, besides files.
#[derive(Clone, Copy, Debug, Default)]
pub struct Parts<'a> {
    /// The view whose function is called.
    pub view_mode: ViewMode,
    /// The caller's own surface function, see [`super::RendererOptions::surface`].
    pub surface: Option<&'a str>,
}

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
    /// The file or part, and its line, from which line `line` (from 1) of the whole text came.
    pub fn origin(&self, line: usize) -> Option<(&str, u32)> {
        self.lines
            .get(line.checked_sub(1)?)
            .map(|(file, line)| (file.as_str(), *line))
    }
}

/// What is wrong with a shader, and where: an import that cannot be followed, or a caller's function that does not
/// compile. It is the source of the [`Error`] that [`super::ClipmapRenderer::new`] returns.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShaderError {
    /// The file, or `surface function`.
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
pub fn compose(name: &str, text: &str, parts: &Parts<'_>) -> Result<Composed, ShaderError> {
    let mut composer = Composer {
        parts,
        seen: vec![name.to_string()],
        out: Composed {
            source: String::new(),
            lines: Vec::new(),
        },
    };
    composer.append(PRELUDE, &crate::shade::wgsl_constants())?;
    composer.append(name, text)?;
    Ok(composer.out)
}

struct Composer<'a> {
    parts: &'a Parts<'a>,
    seen: Vec<String>,
    out: Composed,
}

impl Composer<'_> {
    fn append(&mut self, file: &str, text: &str) -> Result<(), ShaderError> {
        for (line, number) in text.lines().zip(1..) {
            let error = |what: String| ShaderError {
                file: file.to_string(),
                line: number,
                what,
            };
            let Some(rest) = line.trim_start().strip_prefix('#') else {
                self.out.source.push_str(line);
                self.out.source.push('\n');
                self.out.lines.push((file.to_string(), number));
                continue;
            };
            let import = rest.strip_prefix("import ").map(str::trim);
            let import = import.ok_or_else(|| error(format!("expected `#import FILE`, found `{line}`")))?;
            if self.seen.iter().any(|s| s == import) {
                continue;
            }
            self.seen.push(import.to_string());
            let text = self
                .part(import)
                .ok_or_else(|| error(format!("there is no shader file `{import}`")))?;
            self.append(import, &text)?;
        }
        Ok(())
    }

    /// The text of a file or part.
    fn part(&self, name: &str) -> Option<String> {
        match (name, self.parts.surface) {
            (VIEW_COLOUR, _) => Some(format!(
                "fn view_colour(point: SurfacePoint) -> vec4<f32> {{ return view_{}(point); }}\n",
                self.parts.view_mode.name()
            )),
            (SURFACE_FUNCTION, Some(own)) => Some(own.to_string()),
            (SURFACE_FUNCTION, None) => Some("#import shared/look.wgsl\n".to_string()),
            _ => FILES
                .into_iter()
                .find(|(file, _)| *file == name)
                .map(|(_, text)| text.to_string()),
        }
    }
}

/// One of this crate's own shaders, with the parts asked for.
///
/// # Errors
/// [`ErrorKind::Misuse`] where the caller's surface function does not compile, with its line.
///
/// # Panics
/// If the shader is unknown, or its own imports cannot be followed, which a test rules out for all of [`entry_files`].
pub(super) fn module(device: &wgpu::Device, name: &str, parts: &Parts<'_>) -> Result<wgpu::ShaderModule> {
    let (_, text) = FILES
        .into_iter()
        .find(|(file, _)| *file == name)
        .expect("the shader is one of FILES");
    let composed = compose(name, text, parts).map_err(misfit)?;
    let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(&format!("clipscape {name}")),
        source: wgpu::ShaderSource::Wgsl(composed.source.as_str().into()),
    });
    let Some(error) = pollster::block_on(scope.pop()) else {
        return Ok(module);
    };
    let info = pollster::block_on(module.get_compilation_info());
    Err(misfit(explain(&composed, parts, &info, &error)))
}

/// Where in the parts of a shader its compiler stumbled. This crate's own parts compile by themselves, so wherever that is
/// it is about the caller's function, if there is one: then, or where the compiler knows no place, its head is meant.
fn explain(
    composed: &Composed,
    parts: &Parts<'_>,
    info: &wgpu::CompilationInfo,
    error: &wgpu::Error,
) -> ShaderError {
    let first = info
        .messages
        .iter()
        .find(|m| m.message_type == wgpu::CompilationMessageType::Error);
    let place = first
        .and_then(|m| m.location)
        .and_then(|l| composed.origin(l.line_number as usize))
        .filter(|(file, _)| parts.surface.is_none() || *file == SURFACE_FUNCTION);
    let head = || {
        let lines = parts.surface.unwrap_or_default().lines();
        let head = lines.zip(1..).find(|(l, _)| l.contains("fn surface_colour"));
        (SURFACE_FUNCTION, head.map_or(1, |(_, line)| line))
    };
    let (file, line) = place.unwrap_or_else(head);
    ShaderError {
        file: file.to_string(),
        line,
        what: summary(&first.map_or_else(|| error.to_string(), |m| m.message.clone())),
    }
}

/// A compiler's message in one line: what follows its first `error: `, and what it marks in the source that it quotes.
fn summary(message: &str) -> String {
    let first = message.lines().find(|l| !l.trim().is_empty()).unwrap_or_default();
    let mut out = first
        .split_once("error: ")
        .map_or(first, |(_, what)| what)
        .trim()
        .to_string();
    for line in message.lines() {
        let mark = line.rsplit_once('^').map(|(_, mark)| mark.trim());
        // Notes stand below, after an equals sign.
        let note = line.trim_start().strip_prefix("= ");
        if let Some(more) = mark.or(note).filter(|m| !m.is_empty() && !out.contains(m)) {
            out.push_str(", ");
            out.push_str(more);
        }
    }
    out
}

fn misfit(error: ShaderError) -> Error {
    let subject = format!("{}:{}", error.file, error.line);
    Error::new(ErrorKind::Misuse, subject, &error.what)
        .advice("RendererOptions::surface says what it must be")
        .because(error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn imports_are_followed_once_and_lines_traced_back() {
        let text = "#import shared/shade.wgsl\nfn mine() {}\n#import shared/shade.wgsl\n";
        let composed = compose("test.wgsl", text, &Parts::default()).unwrap();
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
        let error = compose(
            "test.wgsl",
            "// a comment\n#import shared/none.wgsl\n",
            &Parts::default(),
        )
        .unwrap_err();
        assert_eq!(
            error.to_string(),
            "test.wgsl:2: there is no shader file `shared/none.wgsl`"
        );
        let error = compose("test.wgsl", "#include x\n", &Parts::default()).unwrap_err();
        assert_eq!(
            error.to_string(),
            "test.wgsl:1: expected `#import FILE`, found `#include x`"
        );
    }

    #[test]
    fn a_message_is_cut_to_what_it_says() {
        let message = "\nShader 'x' parsing error: no definition in scope for identifier: `a`\n  \u{250c}\u{2500} wgsl:3:1\n3 \u{2502} a\n  \u{2502} ^ unknown identifier\n  = note: spell it\n\n";
        assert_eq!(
            summary(message),
            "no definition in scope for identifier: `a`, unknown identifier, note: spell it"
        );
        assert_eq!(summary("all is lost\n"), "all is lost");
        assert_eq!(summary(""), "");
    }

    #[test]
    fn a_caller_s_function_keeps_its_own_lines_and_takes_the_place_of_the_look() {
        let parts = Parts {
            view_mode: ViewMode::Wire,
            surface: Some(
                "// mine\nfn surface_colour(point: SurfacePoint) -> vec4<f32> { return vec4(1.0); }",
            ),
        };
        let own = compose("test.wgsl", "#import shared/ground.wgsl\n", &parts).unwrap();
        let line = own.source.lines().position(|l| l == "// mine").unwrap() + 1;
        assert_eq!(own.origin(line + 1), Some(("surface function", 2)));
        assert_eq!(own.source.matches("fn surface_colour").count(), 1);
        assert!(own.source.contains("return view_wire(point);"));
        let look = compose("test.wgsl", "#import shared/ground.wgsl\n", &Parts::default()).unwrap();
        assert!(look.source.contains("return view_shaded(point);") && look.source.contains("if TINT"));
    }
}
