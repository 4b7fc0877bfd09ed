//! Terrain files as they are made, told of and lit anew.

use std::fs;
use std::path::Path;

use crate::{done, fails, names, run};

#[test]
fn info_says_what_a_terrain_file_is_and_verify_finds_what_is_damaged() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    done(
        here,
        &[
            "preprocess",
            "synth:200:3",
            "--sun",
            "-45,30",
            "--sky-directions",
            "4",
            "--quiet",
        ],
    );
    assert_eq!(names(here), ["synth-200-3.terrain.exr"]);
    let file = "synth-200-3.terrain.exr";

    let json = done(here, &["info", "--json", file]);
    assert_eq!(json.lines().count(), 1);
    let info: serde_json::Value = serde_json::from_str(&json).unwrap();
    let at = |name: &str| {
        json.find(&format!("\"{name}\":"))
            .unwrap_or_else(|| panic!("no {name} in {json}"))
    };
    let documented = "format type width height spacing min max voids vertical_unit vertical_datum crs unit pixel origin \
        extent registration levels destep light day assumed noticed";
    let places: Vec<usize> = documented.split_whitespace().map(at).collect();
    assert!(places.is_sorted(), "{json}");
    assert_eq!(info.as_object().unwrap().len(), places.len(), "{json}");
    assert_eq!(
        (&info["width"], &info["height"], &info["levels"]),
        (&200.into(), &200.into(), &3.into())
    );
    assert_eq!(
        (&info["voids"], &info["crs"]),
        (&0.into(), &serde_json::Value::Null)
    );
    assert_eq!(info["light"]["sun"], serde_json::json!([-45.0, 30.0]));
    assert_eq!(info["light"]["sky_directions"], 4);
    assert!(info["min"].as_f64().unwrap() < info["max"].as_f64().unwrap());

    let raw: serde_json::Value =
        serde_json::from_str(&done(here, &["info", "--json", "synth:200:3"])).unwrap();
    for same in ["width", "height", "spacing", "min", "max", "voids", "levels"] {
        assert_eq!(raw[same], info[same], "{same}");
    }
    assert_eq!(raw["light"], serde_json::Value::Null);

    let text = done(here, &["info", "--verify", file]);
    assert!(
        text.contains("200 x 200 samples") && text.contains("verified"),
        "{text}"
    );

    let path = here.join(file);
    let mut bytes = fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x10;
    fs::write(&path, bytes).unwrap();
    let ran = run(here, &["info", "--verify", file]);
    assert_eq!((ran.status, ran.out.as_str()), (1, ""), "{}", ran.err);
    assert!(
        ran.err.lines().count() >= 1 && ran.err.lines().all(|l| l.starts_with("clipscape: ")),
        "{}",
        ran.err
    );
    assert!(ran.err.contains(file), "{}", ran.err);
}

#[test]
fn a_terrain_file_is_lit_anew() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let make = |input: &str, output: &str, more: &[&str]| {
        let arguments = [
            "preprocess",
            input,
            "--quiet",
            "--sky-directions",
            "2",
            "-o",
            output,
        ];
        done(here, &[&arguments[..], more].concat());
    };
    make("synth:64", "a.terrain.exr", &[]);
    make("synth:64", "low.terrain.exr", &["--sun", "90,5"]);
    make("a.terrain.exr", "b.terrain.exr", &["--sun", "90,5"]);
    let bytes = |name: &str| fs::read(here.join(name)).unwrap();
    assert_eq!(bytes("b.terrain.exr"), bytes("low.terrain.exr"));
    assert_ne!(bytes("b.terrain.exr"), bytes("a.terrain.exr"));
    // In its own place where that is forced, and with the filter that it has.
    let in_place = ["preprocess", "b.terrain.exr"];
    fails(here, 1, &in_place, &["b.terrain.exr", "--force"]);
    let filter = ["preprocess", "b.terrain.exr", "--filter", "box", "--force"];
    fails(here, 1, &filter, &["filter is fixed"]);
    assert_eq!(bytes("b.terrain.exr"), bytes("low.terrain.exr"));
    make("b.terrain.exr", "b.terrain.exr", &["--force"]);
    assert_eq!(bytes("b.terrain.exr"), bytes("a.terrain.exr"));
    assert_eq!(names(here), ["a.terrain.exr", "b.terrain.exr", "low.terrain.exr"]);
}

#[test]
fn the_sun_comes_from_a_time_and_a_place() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let shipped = concat!(env!("CARGO_MANIFEST_DIR"), "/data/N42E001.hgt");
    let at = ["--sun-at", "2026-06-21T09:00:00Z"];
    let preprocess = |input, output, more: &[&str]| {
        let arguments = [
            "preprocess",
            input,
            "--quiet",
            "--sky-directions",
            "0",
            "-o",
            output,
        ];
        run(here, &[&arguments[..], &at[..], more].concat())
    };
    let sun = |name: &str| {
        let info = done(here, &["info", name, "--json"]);
        let info: serde_json::Value = serde_json::from_str(&info).unwrap();
        [0, 1].map(|k| info["light"]["sun"][k].as_f64().unwrap())
    };
    let apart = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
    // The middle of the shipped DEM is 42.5 north, 1.5 east.
    assert_eq!(preprocess(shipped, "a.terrain.exr", &[]).status, 0);
    let place = ["--lat", "42.5", "--lon", "1.5"];
    assert_eq!(preprocess("synth:32", "b.terrain.exr", &place).status, 0);
    let elsewhere = ["--lat", "-42.5", "--lon", "1.5"];
    assert_eq!(preprocess("synth:32", "c.terrain.exr", &elsewhere).status, 0);
    assert!(apart(sun("a.terrain.exr"), sun("b.terrain.exr")) < 1e-6);
    assert!(apart(sun("a.terrain.exr"), sun("c.terrain.exr")) > 1.0);

    let nowhere = preprocess("synth:32", "d.terrain.exr", &[]);
    assert!(
        nowhere.status == 1 && nowhere.err.contains("give --lat and --lon"),
        "{}",
        nowhere.err
    );
    let no_earth = preprocess(
        "synth:32",
        "d.terrain.exr",
        &["--lat", "1", "--lon", "2", "--curvature"],
    );
    assert!(
        no_earth.status == 1 && no_earth.err.contains("no known earth"),
        "{}",
        no_earth.err
    );
    for wrong in [
        &["--sun-at", "noon"][..],
        &["--sun", "1,2", "--sun-at", "2026-06-21T09:00:00Z"],
        &["--lat", "3", "--lon", "4"],
        &["--sun-at", "2026-06-21T09:00:00Z", "--lat", "3"],
        &["--sun-at", "2026-06-21T09:00:00Z", "--lat", "93", "--lon", "4"],
        &["--curvature=1"],
        &["--curvature", "--no-light"],
    ] {
        fails(
            here,
            2,
            &[&["preprocess", "synth:32"][..], wrong].concat(),
            &["clipscape"],
        );
    }
    assert_eq!(names(here), ["a.terrain.exr", "b.terrain.exr", "c.terrain.exr"]);
}

#[cfg(feature = "dem")]
#[test]
fn synth_writes_the_terrain_that_its_name_stands_for() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let ran = run(here, &["synth", "100:5", "-o", "a.tif"]);
    assert_eq!((ran.status, ran.out.as_str()), (0, ""));
    assert!(ran.err.contains("a.tif"), "{}", ran.err);
    let json = |input: &str| -> serde_json::Value {
        serde_json::from_str(&done(here, &["info", "--json", input])).unwrap()
    };
    let (file, name, other) = (json("a.tif"), json("synth:100:5"), json("synth:100:6"));
    assert_eq!((&file["min"], &file["max"]), (&name["min"], &name["max"]));
    assert_ne!(
        file["max"], other["max"],
        "control: another seed is other terrain"
    );
    fails(
        here,
        1,
        &["synth", "100:5", "-o", "a.tif"],
        &["a.tif: ", "exists", "--force"],
    );
    fails(here, 1, &["synth", "100:5", "-o", "a.png"], &["a.png: ", ".tif"]);
    fails(here, 1, &["synth", "many", "-o", "b.tif"], &["synth:many"]);
    assert_eq!(names(here), ["a.tif"]);
}

#[test]
fn a_day_is_traced_told_and_asked_for_by_its_time() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let make = |output, more: &[&str]| {
        let common = [
            "preprocess",
            "synth:300",
            "-o",
            output,
            "--sky-directions",
            "0",
            "--lat",
            "42",
            "--lon",
            "1.5",
        ];
        run(here, &[&common[..], more].concat())
    };
    let at = ["--sun-at", "2026-06-21T09:00Z"];
    let made = make("a.exr", &[&at[..], &["--day", "8"]].concat());
    assert_eq!(made.status, 0, "{}", made.err);
    assert!(made.err.contains("the day runs from 4:"), "{}", made.err);
    assert_eq!(make("b.exr", &at).status, 0);
    let info = |name: &str| -> serde_json::Value {
        serde_json::from_str(&done(here, &["info", name, "--json", "--verify", "--quiet"])).unwrap()
    };
    let day = &info("a.exr")["day"];
    assert_eq!(day["positions"], 8, "{day}");
    assert!(
        day["noon"].as_str().unwrap().starts_with("2026-06-21T11:5"),
        "{day}"
    );
    assert!(info("b.exr")["day"].is_null());
    assert!(done(here, &["info", "a.exr"]).contains("by the sun, noon at 2026-06-21T11:5"));
    assert_eq!(make("c.exr", &["--day", "8"]).status, 2, "a day has a date");
    for wrong in ["1", "5000", "-3"] {
        assert_eq!(
            make("c.exr", &[&at[..], &["--day", wrong]].concat()).status,
            2,
            "{wrong}"
        );
    }
    let night = make(
        "c.exr",
        &[
            "--sun-at",
            "2026-12-21T09:00Z",
            "--day",
            "8",
            "--lat",
            "80",
            "--lon",
            "1",
        ],
    );
    assert_eq!(night.status, 2, "--lat twice: {}", night.err);
    let dark = [
        "preprocess",
        "synth:32",
        "-o",
        "c.exr",
        "--lat",
        "80",
        "--lon",
        "1",
    ];
    let dark = [&dark[..], &["--sun-at", "2026-12-21T09:00Z", "--day", "8"]].concat();
    fails(here, 1, &dark, &["does not rise", "another date"]);
    assert_eq!(names(here), ["a.exr", "b.exr"]);

    #[cfg(feature = "gpu")]
    if clipscape::gpu::open().is_ok() {
        let render = |input, output, more: &[&str]| {
            run(
                here,
                &[
                    &["render", input, "-o", output, "--size", "64x48", "--quiet"][..],
                    more,
                ]
                .concat(),
            )
        };
        for (output, time) in [
            ("m.png", "7:00"),
            ("n.png", "12:00"),
            ("o.png", "2026-06-21T11:55:00Z"),
        ] {
            let ran = render("a.exr", output, &["--sun-time", time]);
            assert_eq!((ran.status, ran.err.as_str()), (0, ""), "{time}");
        }
        let picture = |name: &str| fs::read(here.join(name)).unwrap();
        assert_ne!(picture("m.png"), picture("n.png"), "the morning looks otherwise");
        let ran = render("b.exr", "p.png", &["--sun-time", "7:00"]);
        assert!(
            ran.status == 1 && ran.err.contains("preprocess --sun-at TIME --day N"),
            "{}",
            ran.err
        );
        assert_eq!(render("a.exr", "p.png", &["--sun-time", "25:00"]).status, 2);
        let keys = r#"{"t": 0, "eye": [100, 5000, 100], "heading": 90, "pitch": -60, "sun_time": HOUR}"#;
        let flight = |hour: &str| format!(r#"{{"keys": [{}]}}"#, keys.replace("HOUR", hour));
        fs::write(here.join("f.json"), flight("8.5")).unwrap();
        assert_eq!(render("a.exr", "f", &["--flight", "f.json"]).status, 0);
        let none = render("b.exr", "g", &["--flight", "f.json"]);
        assert!(
            none.status == 1 && none.err.contains("sun_time in the flight"),
            "{}",
            none.err
        );
        let both = render("a.exr", "g", &["--flight", "f.json", "--sun-time", "9:00"]);
        assert!(
            both.status == 1 && both.err.contains("leave one of them out"),
            "{}",
            both.err
        );
    }
}

#[test]
fn only_a_dem_with_steps_is_freed_of_them_and_info_and_the_statistics_say_so() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let dem = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/N42E001.hgt");
    let dem = dem.to_str().unwrap();
    let part = ["preprocess", dem, "--srcwin", "400,700,200,150", "--no-light"];
    let made = [&part[..], &["--destep", "-o", "a.exr", "--stats", "a.json"]].concat();
    let said = run(here, &made);
    assert_eq!(said.status, 0, "{}", said.err);
    let median = "true over stored 1.000000 in the median";
    assert!(said.err.contains(median), "{}", said.err);
    let stats: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(here.join("a.json")).unwrap()).unwrap();
    assert!(stats["checked_patches"].as_u64().unwrap() > 0);
    let ratio = |name: &str| stats[name].as_f64().unwrap();
    assert!(ratio("error_ratio_least") <= ratio("error_ratio_median") && ratio("error_ratio_median") <= 1.0);
    let info =
        |file| -> serde_json::Value { serde_json::from_str(&done(here, &["info", "--json", file])).unwrap() };
    assert_eq!(info("a.exr")["destep"], 1.0);
    let text = done(here, &["info", "a.exr"]);
    assert!(
        text.contains("steps of 1 m smoothed away, by at most 0.5 m"),
        "{text}"
    );
    done(here, &[&part[..], &["-o", "b.exr", "--quiet"]].concat());
    assert!(info("b.exr")["destep"].is_null());

    let floats = ["preprocess", "synth:64:1", "--destep", "-o", "c.exr"];
    fails(
        here,
        1,
        &floats,
        &["float32", "not whole numbers of one step", "leave out"],
    );
    let again = ["preprocess", "b.exr", "--destep", "-o", "c.exr"];
    fails(
        here,
        1,
        &again,
        &["b.exr", "heights are fixed", "when it is made"],
    );
    assert_eq!(names(here), ["a.exr", "a.json", "b.exr"]);
}
