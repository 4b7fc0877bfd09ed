//! Shaders parse, validate, and agree with the structs that Rust mirrors; no device is needed.
#![cfg(feature = "gpu")]

use std::collections::HashSet;

use clipscape::clipmap::{LevelConstants, ViewConstants};
use clipscape::gpu::{Parts, compose, entry_files};
use clipscape::shade::{ShadeConstants, ViewMode};

fn source(name: &str) -> String {
    source_of(name, &Parts::default())
}

fn source_of(name: &str, parts: &Parts<'_>) -> String {
    compose("test.wgsl", &format!("#import {name}\n"), parts)
        .unwrap_or_else(|e| panic!("{e}"))
        .source
}

fn parse(source: &str) -> naga::Module {
    naga::front::wgsl::parse_str(source).unwrap_or_else(|e| panic!("{}", e.emit_to_string(source)))
}

fn validate(module: &naga::Module) -> Result<naga::valid::ModuleInfo, String> {
    let mut validator = naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::empty(),
    );
    validator.validate(module).map_err(|e| format!("{e:?}"))
}

#[test]
fn every_shader_validates_and_no_binding_is_used_twice() {
    let files: Vec<_> = entry_files().collect();
    assert!(files.contains(&"terrain.wgsl") && files.contains(&"sky.wgsl"));
    for name in files {
        let module = parse(&source(name));
        validate(&module).unwrap_or_else(|e| panic!("{name}: {e}"));
        let mut used = HashSet::new();
        for (_, variable) in module.global_variables.iter() {
            if let Some(binding) = &variable.binding {
                assert!(
                    used.insert((binding.group, binding.binding)),
                    "{name}: {binding:?} is used twice"
                );
            }
        }
        for entry in &module.entry_points {
            assert!(
                ["vertex", "fragment"]
                    .iter()
                    .any(|stage| entry.name.ends_with(stage)),
                "{name}: {}",
                entry.name
            );
        }
    }
}

#[test]
fn every_view_validates_with_and_without_a_function_of_the_caller_s() {
    // The example in the documentation of RendererOptions::surface.
    let documentation = include_str!("../src/gpu/options.rs");
    let lines = documentation
        .lines()
        .map(|l| l.trim_start().trim_start_matches("///"));
    let example = lines
        .skip_while(|l| !l.contains("fn surface_colour(point: SurfacePoint) -> vec4<f32> {"))
        .take_while(|l| !l.contains("```"));
    let example: String = example.flat_map(|l| [l, "\n"]).collect();
    assert!(example.contains("height_m / 100.0"), "{example}");
    for (name, view_mode) in ViewMode::NAMED {
        for surface in [None, Some(example.as_str())] {
            for file in ["terrain.wgsl", "closer.wgsl"] {
                let module = parse(&source_of(file, &Parts { view_mode, surface }));
                validate(&module).unwrap_or_else(|e| panic!("{file}, {name}: {e}"));
            }
        }
    }
}

#[test]
fn what_is_documented_of_a_surface_point_is_what_the_shader_has() {
    let members = |text: &str| -> Vec<String> {
        let lines = text
            .lines()
            .map(|l| l.trim_start().trim_start_matches("///").trim());
        let body = lines.skip_while(|l| !l.starts_with("struct SurfacePoint {"));
        body.take_while(|l| !l.starts_with('}'))
            .map(str::to_string)
            .collect()
    };
    let documented = members(include_str!("../src/gpu/options.rs"));
    assert!(documented.len() > 9);
    assert_eq!(documented, members(include_str!("../shaders/shared/point.wgsl")));
}

#[test]
fn control_an_invalid_shader_is_caught() {
    let spoiled = source("terrain.wgsl").replace("return vec4(tone(radiance), 1.0);", "return radiance.x;");
    assert_ne!(spoiled, source("terrain.wgsl"));
    let caught = match naga::front::wgsl::parse_str(&spoiled) {
        Ok(module) => validate(&module).is_err(),
        Err(_) => true,
    };
    assert!(caught);
}

/// Names and offsets of a WGSL struct's members, and its span.
fn layout(source: &str, name: &str) -> (Vec<(String, u32)>, u32) {
    let module = parse(source);
    let (_, ty) = module
        .types
        .iter()
        .find(|(_, t)| t.name.as_deref() == Some(name))
        .expect(name);
    let naga::TypeInner::Struct { members, span } = &ty.inner else {
        panic!("{name} is not a struct")
    };
    (
        members
            .iter()
            .map(|m| (m.name.clone().unwrap(), m.offset))
            .collect(),
        *span,
    )
}

macro_rules! our_layout {
    ($t:ident { $($f:ident),* $(,)? }) => {
        (
            vec![$((stringify!($f).to_string(), std::mem::offset_of!($t, $f) as u32)),*],
            size_of::<$t>() as u32,
        )
    };
}

#[test]
fn mirrored_structs_have_the_layout_that_shaders_read() {
    let terrain = source("terrain.wgsl");
    let ours = our_layout!(ViewConstants {
        clip_from_east,
        clip_from_up,
        clip_from_south,
        ray_right,
        ray_up,
        ray_middle,
        anchor,
        fraction,
        spacing_m,
        eye_height_m,
        edge,
        size_px,
        vertical_scale,
        near_m,
        reach,
        transition,
        slot_mask,
        held_mask,
        depth,
    });
    assert_eq!(ours, layout(&terrain, "ViewConstants"));
    let ours = our_layout!(LevelConstants {
        last,
        slot_shift,
        parent_last,
        inverse_step,
        climb,
        light_at_eye,
        light_scale,
        has_coarser,
    });
    assert_eq!(ours, layout(&terrain, "LevelConstants"));
    let ours = our_layout!(ShadeConstants {
        to_sun,
        low_m,
        high_m,
        base_m,
        slope_scale,
        per_relief,
        eye_haze,
        eye_density,
        day_time
    });
    assert_eq!(ours, layout(&terrain, "ShadeConstants"));
}

#[test]
fn control_swapped_and_widened_fields_are_caught() {
    let source = source("terrain.wgsl");
    let line = |name: &str| {
        source
            .lines()
            .find(|l| l.trim_start().starts_with(name))
            .expect(name)
            .to_string()
            + "\n"
    };
    let (reach, transition) = (line("reach: f32"), line("transition: f32"));
    let swapped = source.replace(&format!("{reach}{transition}"), &format!("{transition}{reach}"));
    assert_ne!(swapped, source);
    validate(&parse(&swapped)).expect("the spoiled shader is still a shader");
    assert_ne!(
        layout(&source, "ViewConstants"),
        layout(&swapped, "ViewConstants")
    );
    let widened = source.replace(&line("low_m: f32"), "    low_m: f32,\n    unknown_m: f32,\n");
    validate(&parse(&widened)).expect("the spoiled shader is still a shader");
    assert_ne!(
        layout(&source, "ShadeConstants"),
        layout(&widened, "ShadeConstants")
    );
}
