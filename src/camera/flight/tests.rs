//! Tests of flights.

use super::*;

fn key(t_s: f64, eye: [f64; 3], heading_deg: f64) -> Key {
    Key {
        t_s,
        eye,
        heading_deg,
        pitch_deg: -10.0,
        roll_deg: 0.0,
        fov_deg: 60.0,
        sun_hour: None,
    }
}

fn flight(keys: &[(f64, f64)]) -> Flight {
    Flight::new(
        30.0,
        keys.iter()
            .map(|&(t, heading)| key(t, [t, 0.0, 0.0], heading))
            .collect(),
    )
    .unwrap()
}

#[test]
fn what_may_be_left_out_takes_its_default() {
    let json = r#"{"keys": [{"t": 0, "eye": [1, 2, 3], "heading": 40, "pitch": -5}]}"#;
    let flight = Flight::parse("f.json", json).unwrap();
    assert_eq!((flight.fps(), flight.frame_count()), (30.0, 1));
    let camera = flight.camera_at_frame(0);
    assert_eq!(
        (camera.eye, camera.roll_deg, camera.fov_deg),
        (DVec3::new(1.0, 2.0, 3.0), 0.0, 60.0)
    );
}

#[test]
fn what_is_wrong_is_named_in_one_line() {
    let good = r#""eye": [0, 0, 0], "heading": 0, "pitch": 0"#;
    for (json, says) in [
        (r#"{"keys": []}"#.to_string(), "no keys"),
        ("{}".into(), "missing field `keys`"),
        ("not json".into(), "line 1"),
        (
            format!(r#"{{"keys": [{{"t": 0, {good}, "zoom": 1}}]}}"#),
            "unknown field `zoom`",
        ),
        (
            format!(r#"{{"speed": 1, "keys": [{{"t": 0, {good}}}]}}"#),
            "unknown field `speed`",
        ),
        (
            format!(r#"{{"frame": "sea", "keys": [{{"t": 0, {good}}}]}}"#),
            "unknown variant `sea`",
        ),
        (format!(r#"{{"keys": [{{{good}}}]}}"#), "missing field `t`"),
        (
            r#"{"keys": [{"t": 0, "eye": [0, 0, 0], "pitch": 0}]}"#.into(),
            "missing field `heading`",
        ),
        (
            r#"{"keys": [{"t": 0, "eye": [0, 0], "heading": 0, "pitch": 0}]}"#.into(),
            "line 1",
        ),
        (
            r#"{"keys": [{"t": 0, "eye": [0, 0, 0], "heading": 1e999, "pitch": 0}]}"#.into(),
            "out of range",
        ),
        (
            format!(r#"{{"keys": [{{"t": 1, {good}}}, {{"t": 1, {good}}}]}}"#),
            "strictly rise",
        ),
        (format!(r#"{{"keys": [{{"t": -1, {good}}}]}}"#), "at least 0"),
        (
            format!(r#"{{"keys": [{{"t": 0, {good}, "fov": 180}}]}}"#),
            "field of view of 180",
        ),
        (
            format!(r#"{{"fps": 0, "keys": [{{"t": 0, {good}}}]}}"#),
            "fps of 0",
        ),
        (
            r#"{"keys": [{"t": 0, "eye": [1e300, 0, 0], "heading": 0, "pitch": 0}]}"#.into(),
            "farther than 1e31 m",
        ),
    ] {
        let error = Flight::parse("f.json", &json).unwrap_err();
        let line = error.to_string();
        assert_eq!(error.kind(), ErrorKind::Broken, "{json}: {line}");
        assert!(
            line.starts_with("f.json: ") && line.contains(says),
            "{json}: {line}"
        );
        assert!(!line.contains('\n'));
    }
    let long = format!(r#"{{"keys": [{{"t": 1e9, {good}}}]}}"#);
    assert_eq!(
        Flight::parse("f.json", &long).unwrap_err().kind(),
        ErrorKind::Limit
    );
    assert_eq!(Flight::new(30.0, vec![]).unwrap_err().kind(), ErrorKind::Misuse);
}

#[test]
fn a_flight_over_the_map_is_none_in_world_metres() {
    let json = r#"{"frame": "crs", "keys": [{"t": 0, "at": [1.5, 42.5], "above_m": 300, "heading": 0, "pitch": 0}]}"#;
    assert_eq!(
        Flight::parse("f.json", json).unwrap_err().kind(),
        ErrorKind::Misuse
    );
    assert!(is_crs(json) && crate::camera::CrsFlight::parse("f.json", json).is_ok());
    let world = json.replace("crs", "world");
    assert_eq!(
        Flight::parse("f.json", &world).unwrap_err().kind(),
        ErrorKind::Broken,
        "control"
    );
}

#[test]
fn frames_are_counted_to_the_last_key_whatever_the_rounding() {
    let frames = |t: f64, fps: f64| {
        Flight::new(fps, vec![key(t, [0.0; 3], 0.0)])
            .unwrap()
            .frame_count()
    };
    assert_eq!(frames(4.0, 30.0), 121);
    assert_eq!(frames(0.0, 30.0), 1);
    assert_eq!(frames(3.9999, 30.0), 120);
    let mut below = 0;
    for fps in [24.0, 25.0, 29.97, 30.0, 60.0, 7.0, 0.1] {
        for k in 0..3000_u64 {
            let t = k as f64 / fps;
            below += u32::from(((t * fps).floor() as u64) < k);
            assert_eq!(frames(t, fps), k + 1, "frame {k} at {fps} a second");
        }
    }
    assert!(
        below > 0,
        "control: plain floor would have counted all of them rightly"
    );
}

#[test]
fn the_path_goes_through_its_keys_and_keeps_even_motion_even() {
    let times = [0.0, 0.3, 2.0, 2.1, 5.0];
    let line = |t: f64| [100.0 * t, 3000.0 - 10.0 * t, 7.0];
    let even = Flight::new(
        30.0,
        times.iter().map(|&t| key(t, line(t), 350.0 + 8.0 * t)).collect(),
    )
    .unwrap();
    for i in 0..=500 {
        let t = f64::from(i) / 100.0;
        let camera = even.camera_at(t);
        assert!(
            (camera.eye - DVec3::from_array(line(t))).length() < 1e-9,
            "at {t} s: {}",
            camera.eye
        );
        let off = (camera.heading_deg - (350.0 + 8.0 * t) + 180.0).rem_euclid(360.0) - 180.0;
        assert!(off.abs() < 1e-9, "at {t} s: {}", camera.heading_deg);
    }
    let bent = flight(&[(0.0, 0.0), (1.0, 90.0), (1.5, 20.0), (4.0, 21.0)]);
    for key in bent.keys() {
        assert_eq!(bent.camera_at(key.t_s), key.camera());
    }
    assert_eq!(bent.camera_at(99.0).heading_deg, 21.0);
}

#[test]
fn speed_has_no_step_at_a_key() {
    let bent = flight(&[(0.0, 0.0), (1.0, 90.0), (1.5, 20.0), (4.0, 21.0)]);
    let heading = |t: f64| bent.camera_at(t).heading_deg;
    let d = 1e-5;
    for t in [1.0, 1.5] {
        let (before, after) = (
            (heading(t) - heading(t - d)) / d,
            (heading(t + d) - heading(t)) / d,
        );
        assert!(
            (before - after).abs() < 0.05,
            "at {t} s: {before} and {after} degrees a second"
        );
    }
    let straight: f64 = (90.0 - 0.0) - (20.0 - 90.0) / 0.5;
    assert!(
        straight.abs() > 100.0,
        "control: straight pieces would turn by {straight} there"
    );
}

#[test]
fn angles_go_the_short_way_and_half_turns_clockwise() {
    let middle = |a: f64, b: f64| flight(&[(0.0, a), (1.0, b)]).camera_at(0.5).heading_deg;
    assert_eq!(middle(350.0, 10.0), 0.0);
    assert_eq!(middle(10.0, 350.0), 0.0);
    assert_eq!(middle(90.0, 270.0), 180.0);
    assert_eq!(middle(270.0, 90.0), 0.0);
    assert_eq!(middle(-725.0, 725.0), 0.0);
}

#[test]
fn cubics_never_leave_the_range_of_angles() {
    let pitches = [-90.0, -90.0, 90.0, 90.0, -90.0];
    let fovs = [1.0, 1.0, 179.0, 179.0, 1.0];
    let keys = (0..5).map(|i| Key {
        pitch_deg: pitches[i],
        fov_deg: fovs[i],
        ..key(i as f64 * i as f64, [0.0; 3], 0.0)
    });
    let flight = Flight::new(30.0, keys.collect()).unwrap();
    for k in 0..flight.frame_count() {
        flight
            .camera_at_frame(k)
            .check()
            .unwrap_or_else(|e| panic!("frame {k}: {e}"));
    }
}

#[test]
fn json_keeps_a_flight_bit_for_bit() {
    let keys = vec![
        key(0.1, [1.0 / 3.0, -2e-9, 3e7], 359.0),
        key(0.7, [0.1, 0.2, 0.3], 1.0),
    ];
    let flight = Flight::new(29.97, keys).unwrap();
    assert_eq!(Flight::parse("again", &flight.to_json()).unwrap(), flight);
}

#[test]
fn hours_by_the_sun_are_linear_and_in_all_keys_or_none() {
    let key = |t_s, hour| Key {
        sun_hour: hour,
        ..key(t_s, [0.0; 3], 0.0)
    };
    let flight = Flight::new(
        30.0,
        vec![key(0.0, Some(6.0)), key(1.0, Some(8.0)), key(3.0, Some(9.0))],
    )
    .unwrap();
    for (t_s, hour) in [
        (-1.0, 6.0),
        (0.0, 6.0),
        (0.5, 7.0),
        (1.0, 8.0),
        (2.0, 8.5),
        (9.0, 9.0),
    ] {
        assert_eq!(flight.sun_hour_at(t_s), Some(hour), "{t_s} s");
    }
    let json = flight.to_json();
    assert!(json.contains("\"sun_time\":6.0"), "{json}");
    assert_eq!(Flight::parse("f", &json).unwrap(), flight);
    assert_eq!(flight.scaled_down(2.0).unwrap().sun_hour_at(0.5), Some(7.0));
    let without = Flight::new(30.0, vec![key(0.0, None)]).unwrap();
    assert!(without.sun_hour_at(0.0).is_none() && !without.to_json().contains("sun_time"));
    for keys in [
        vec![key(0.0, Some(6.0)), key(1.0, None)],
        vec![key(0.0, None), key(1.0, Some(6.0))],
        vec![key(0.0, Some(f64::NAN))],
        vec![key(0.0, Some(49.0))],
    ] {
        let refused = Flight::new(30.0, keys).unwrap_err().to_string();
        assert!(refused.contains("sun_time"), "{refused}");
    }
}
