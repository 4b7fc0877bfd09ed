//! What colours the ground: a caller's own surface function, its errors, and the wire view.
#![cfg(feature = "gpu")]

#[path = "support/stage.rs"]
mod stage;
mod support;

use clipscape::camera::{Camera, View};
use clipscape::error::ErrorKind;
use clipscape::gpu::{ClipmapRenderer, RendererOptions, ShaderError};
use clipscape::grid::Grid;
use clipscape::shade::ViewMode;
use glam::DVec3;
use stage::Stage;
use support::{Formula, Random, gpu, hills, seed};

const SIZE_PX: [u32; 2] = [96, 96];

type Ground = Formula<fn(u32, i64, i64) -> f32>;

fn hilly() -> Ground {
    Formula::new(Grid::new(701, 523, [8.0, 16.0]), hills)
}

const CAMERA: Camera = Camera {
    eye: DVec3::new(2500.0, 900.0, 5000.0),
    heading_deg: 0.0,
    pitch_deg: -30.0,
    roll_deg: 0.0,
    fov_deg: 90.0,
};

#[test]
fn a_function_of_the_caller_s_colours_the_ground() {
    let Some(gpu) = gpu() else { return };
    let levels = hilly();
    let surface = "
// East of a line is red, west of it blue; the line is at the world's x of 2500 m, where the eye is.
const RED = vec3(1.0, 0.0, 0.0);
fn surface_colour(point: SurfacePoint) -> vec4<f32> {
    return vec4(select(vec3(0.0, 0.0, 1.0), RED, point.from_eye_m.x > 0.0), 0.5);
}";
    for sample_count in [1, 4] {
        let options = RendererOptions {
            surface: Some(surface.to_string()),
            sample_count,
            ..Default::default()
        };
        let stage = Stage::new(&gpu, &options, SIZE_PX);
        let view = View::new(CAMERA, SIZE_PX).unwrap();
        let colours = stage.colours(&stage.picture(&levels, &mut stage.eye(&levels, 64), &view));
        let (mut east, mut west) = (0, 0);
        for (k, pixel) in colours.chunks(4).enumerate() {
            let right = k as u32 % SIZE_PX[0] >= SIZE_PX[0] / 2;
            match pixel {
                [255, 0, 0, 128] if right => east += 1,
                [0, 0, 255, 128] if !right => west += 1,
                [0, 0, 0, 255] => {}
                other => assert!(sample_count == 4, "{other:?} at {k}"),
            }
        }
        assert!(east > 2000 && west > 2000, "{east} {west}");
    }
}

#[test]
fn functions_that_do_not_fit_are_refused_with_the_caller_s_own_line() {
    let Some(gpu) = gpu() else { return };
    let of = |surface: &str| {
        let options = RendererOptions {
            surface: Some(surface.to_string()),
            ..Default::default()
        };
        ClipmapRenderer::new(&gpu.device, &options).unwrap_err()
    };
    let head = "// A comment.\nfn surface_colour(point: SurfacePoint) -> vec4<f32> {\n";
    for (surface, line) in [
        (format!("{head}    return vec4(unknown);\n}}"), 3),
        (
            format!("{head}    let x = 1.0;\n    return vec4(x, point.slope, 0.0, 1.0);\n}}"),
            4,
        ),
        // Of a wrong result the compiler knows no place: the function's head is named.
        (format!("{head}    return vec3(1.0);\n}}"), 2),
        (format!("{head}    return vec4(1.0)\n}}"), 4),
        (
            format!("{head}    return vec4(1.0);\n}}\n\nfn tone(x: f32) -> f32 {{ return x; }}"),
            6,
        ),
        ("#import nothing.wgsl".to_string(), 1),
    ] {
        let error = of(&surface);
        assert_eq!(error.kind(), ErrorKind::Misuse, "{error}");
        let source = std::error::Error::source(&error).and_then(|s| s.downcast_ref::<ShaderError>());
        let source = source.expect("the source is a ShaderError");
        assert_eq!(
            (source.file.as_str(), source.line),
            ("surface function", line),
            "{error}"
        );
        assert!(
            error
                .to_string()
                .starts_with(&format!("surface function:{line}: "))
                && !source.what.contains('\n'),
            "{error}"
        );
    }
    // What is missing or too much has no line of the caller's, but still says what.
    let error = of("fn other() {}");
    assert!(error.to_string().contains("surface_colour"), "{error}");
    let error = of("@group(1) @binding(0) var<uniform> own: vec4<f32>;
fn surface_colour(point: SurfacePoint) -> vec4<f32> { return own; }");
    assert_eq!(error.kind(), ErrorKind::Misuse, "{error}");
}

#[test]
fn wire_frames_follow_the_triangles_edges() {
    let Some(gpu) = gpu() else { return };
    // A DEM that ends within a patch, seen from straight above: an edge every so many pixels.
    let levels: Ground = Formula::new(Grid::new(60, 45, [10.0, 10.0]), |_, _, _| 0.0);
    let camera = Camera {
        eye: DVec3::new(305.0, 400.0, 195.0),
        pitch_deg: -90.0,
        ..CAMERA
    };
    let size_px = [800, 800];
    let view = View::new(camera, size_px).unwrap();
    let draw = |view_mode| {
        let options = RendererOptions {
            view_mode,
            surface: Some(
                "fn surface_colour(p: SurfacePoint) -> vec4<f32> { return vec4(0.0, 0.0, 0.0, 1.0); }".into(),
            ),
            ..Default::default()
        };
        let stage = Stage::new(&gpu, &options, size_px);
        stage.colours(&stage.picture(&levels, &mut stage.eye(&levels, 64), &view))
    };
    let wire = draw(ViewMode::Wire);
    // A pixel is a metre on the ground, and the picture's middle is the eye.
    let bright = |x: f64, z: f64| {
        let (px, py) = ((x - 305.0 + 400.0) as usize, (z - 195.0 + 400.0) as usize);
        wire[4 * (py * 800 + px)] > 60
    };
    let seed = seed(11);
    let mut random = Random(seed);
    for _ in 0..2000 {
        let cell = [random.bits() % 59, random.bits() % 44].map(|c| c as f64 * 10.0);
        let along = random.uniform(0.5, 9.5).floor() + 0.01;
        let [x, z] = cell;
        // Lines lie on the border between two pixels, or through their corners: one of the two shows it.
        let near = |x: f64, z: f64, across: [f64; 2]| bright(x, z) || bright(x - across[0], z - across[1]);
        assert!(
            near(x, z + along, [1.0, 0.0]) || x == 0.0,
            "seed {seed}: column at {x}"
        );
        assert!(
            near(x + along, z, [0.0, 1.0]) || z == 0.0,
            "seed {seed}: row at {z}"
        );
        assert!(bright(x + along, z + along), "seed {seed}: diagonal at {x} {z}");
        let (u, v) = (random.uniform(5.5, 8.0), random.uniform(2.0, 3.0));
        assert!(
            !bright(x + u, z + v),
            "seed {seed}: no edge at {x} + {u}, {z} + {v}"
        );
        assert!(
            !bright(x + v, z + u),
            "seed {seed}: no edge at {x} + {v}, {z} + {u}"
        );
    }
    assert!(
        draw(ViewMode::Shaded).chunks(4).all(|p| p[0] == 0),
        "control: lines are the view's"
    );
}
