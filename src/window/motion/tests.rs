use super::*;
use winit::keyboard::KeyCode;

fn camera(eye: DVec3, heading_deg: f64, pitch_deg: f64) -> Camera {
    Camera {
        eye,
        heading_deg,
        pitch_deg,
        roll_deg: 0.0,
        fov_deg: 60.0,
    }
}

fn held(codes: &[KeyCode]) -> Held {
    let mut held = Held::default();
    for &code in codes {
        held.set(code, true);
    }
    held
}

/// Hills of 300 m, one hole, nothing off the grid.
fn hills(x: f64, z: f64) -> Option<f64> {
    let on = (0.0..=30_000.0).contains(&x) && (0.0..=30_000.0).contains(&z);
    let hole = (x - 9000.0).hypot(z - 9000.0) < 500.0;
    (on && !hole).then(|| 1000.0 + 300.0 * (x / 700.0).sin() * (z / 400.0).cos())
}

fn over<'a>(
    grid: &'a Grid,
    vertical_scale: f64,
    height_m: &'a dyn Fn(f64, f64) -> Option<f64>,
) -> Ground<'a> {
    Ground {
        grid,
        vertical_scale,
        range_m: [700.0, 1300.0],
        height_m,
    }
}

#[test]
fn each_key_moves_its_way() {
    let grid = Grid::new(1001, 1001, [30.0, 30.0]);
    let flat = |_: f64, _: f64| Some(1000.0);
    let ground = over(&grid, 1.0, &flat);
    let from = DVec3::new(5000.0, 1400.0, 5000.0);
    for (code, way) in [
        (KeyCode::KeyW, DVec3::X),
        (KeyCode::ArrowDown, DVec3::NEG_X),
        (KeyCode::KeyA, DVec3::NEG_Z),
        (KeyCode::ArrowRight, DVec3::Z),
        (KeyCode::KeyE, DVec3::Y),
        (KeyCode::PageDown, DVec3::NEG_Y),
    ] {
        let mut pilot = Pilot::new(camera(from, 90.0, 0.0));
        assert!(pilot.rests(&held(&[])) && !pilot.rests(&held(&[code])));
        for _ in 0..20 {
            assert!(pilot.advance(&held(&[code]), 1.0 / 60.0, &ground));
        }
        let moved = pilot.camera.eye - from;
        assert!(moved.dot(way) > 0.999 * moved.length(), "{code:?}: {moved}");
        // Let go, it comes to rest.
        let mut frames = 0;
        while !pilot.rests(&held(&[])) {
            pilot.advance(&held(&[]), 1.0 / 60.0, &ground);
            frames += 1;
        }
        assert!(
            (10..120).contains(&frames),
            "{code:?}: rests after {frames} frames"
        );
        assert!(!pilot.advance(&held(&[]), 1.0 / 60.0, &ground));
    }
    let mut pilot = Pilot::new(camera(from, 90.0, 0.0));
    pilot.advance(&held(&[KeyCode::KeyL, KeyCode::KeyK]), 0.5, &ground);
    assert_eq!((pilot.camera.heading_deg, pilot.camera.pitch_deg), (120.0, -30.0));
    pilot.look([-720.0 / 6.0, 0.0], 720.0);
    assert!((pilot.camera.heading_deg - 110.0).abs() < 1e-9);
    pilot.look([0.0, -1e9], 720.0);
    assert_eq!(pilot.camera.pitch_deg, 90.0);
    assert_eq!(pilot.camera.eye, from);
}

#[test]
fn speed_grows_with_height_and_by_wheel_and_keys() {
    let mut pilot = Pilot::new(camera(DVec3::ZERO, 0.0, 0.0));
    let speed = |pilot: &Pilot, above, codes: &[KeyCode]| pilot.speed_m_per_s(above, 30.0, &held(codes));
    assert_eq!(speed(&pilot, 1000.0, &[]), 600.0);
    assert_eq!(speed(&pilot, 2000.0, &[]), 1200.0);
    assert_eq!(speed(&pilot, 1000.0, &[KeyCode::ShiftLeft]), 2400.0);
    assert_eq!(speed(&pilot, 1000.0, &[KeyCode::ControlRight]), 150.0);
    assert_eq!(
        speed(&pilot, 0.0, &[]),
        speed(&pilot, 8.0 * 30.0, &[]),
        "near the ground it does not stop"
    );
    pilot.shift_speed(1);
    assert_eq!(speed(&pilot, 1000.0, &[]), 750.0);
    pilot.shift_speed(-1000);
    let least = speed(&pilot, 1000.0, &[]);
    pilot.shift_speed(-1);
    assert!(least > 0.0 && speed(&pilot, 1000.0, &[]) == least);
}

/// Seconds of random keys, drags and frame times over hills; whether the eye was ever below the ground, as drawn.
fn random_flight(seed: u64, vertical_scale: f64, below_ground: bool) -> bool {
    let grid = Grid::new(1001, 1001, [30.0, 30.0]);
    let ground = over(&grid, vertical_scale, &hills);
    let mut state = seed;
    let mut random = move || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        state >> 33
    };
    let mut pilot = Pilot::new(camera(DVec3::new(15e3, 1500.0, 15e3), 0.0, -20.0));
    pilot.keep_above(&ground);
    pilot.below_ground = below_ground;
    let keys = [
        KeyCode::KeyW,
        KeyCode::KeyS,
        KeyCode::KeyA,
        KeyCode::KeyD,
        KeyCode::KeyE,
        KeyCode::KeyQ,
        KeyCode::KeyQ,
        KeyCode::ShiftLeft,
    ];
    let mut held = Held::default();
    let mut below = false;
    for _ in 0..4000 {
        if random() % 5 == 0 {
            held.set(keys[(random() % 8) as usize], random() % 2 == 0);
        }
        pilot.look(
            [(random() % 200) as f64 - 100.0, (random() % 100) as f64 - 50.0],
            720.0,
        );
        pilot.shift_speed((random() % 3) as i32 - 1);
        pilot.advance(&held, (random() % 100) as f64 / 1000.0, &ground);
        let eye = pilot.camera.eye;
        pilot.camera.check().unwrap();
        if let Some(h) = hills(eye.x, eye.z) {
            below |= (eye.y - h) * vertical_scale < 0.99 * ground.clearance_m();
        }
    }
    below
}

#[test]
fn the_camera_stays_above_the_ground_unless_asked() {
    for scale in [1.0, 0.3, 4.0, -1.5] {
        for seed in 1..6 {
            assert!(!random_flight(seed, scale, false), "seed {seed}, scale {scale}");
        }
        assert!(
            (1..6).any(|seed| random_flight(seed, scale, true)),
            "control: allowed below the ground, no flight gets there at scale {scale}"
        );
    }
    random_flight(1, 0.0, false);
}

#[test]
fn the_clearance_follows_the_spacing() {
    let flat = |_: f64, _: f64| Some(5.0);
    for (spacing, clearance) in [(30.0, 1.5), (1000.0, 2.0), (1e-3, 5e-5)] {
        let grid = Grid::new(100, 100, [spacing, spacing]);
        let ground = over(&grid, 1.0, &flat);
        assert!((ground.clearance_m() - clearance).abs() < 1e-12);
        let lifted = ground.lifted(DVec3::new(0.0, -100.0, 0.0));
        assert_eq!(lifted.y, 5.0 + ground.clearance_m());
        assert_eq!(ground.lifted(lifted), lifted);
    }
}

#[test]
fn the_camera_cannot_be_lost() {
    let grid = Grid::new(1001, 1001, [30.0, 30.0]);
    let ground = over(&grid, 1.0, &hills);
    let mut pilot = Pilot::new(camera(DVec3::new(15e3, 1500.0, 15e3), 90.0, 10.0));
    for _ in 0..2000 {
        pilot.shift_speed(1);
        pilot.advance(&held(&[KeyCode::KeyW, KeyCode::ShiftLeft]), 0.1, &ground);
    }
    let eye = pilot.camera.eye;
    assert!(eye.x == 21.0 * 30_000.0 && eye.is_finite(), "{eye}");
}
