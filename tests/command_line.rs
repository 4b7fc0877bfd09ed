//! The program as a user meets it: exit status, standard output, standard error, and what is left in the folder.
#![cfg(feature = "cli")]

use std::ffi::OsStr;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

/// What a run of the program gave.
struct Ran {
    status: i32,
    out: String,
    err: String,
}

fn program() -> Command {
    Command::new(env!("CARGO_BIN_EXE_clipscape"))
}

fn run<S: AsRef<OsStr>>(folder: &Path, arguments: &[S]) -> Ran {
    let output = program()
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program starts");
    Ran {
        status: output.status.code().expect("no signal ended it"),
        out: String::from_utf8(output.stdout).expect("text"),
        err: String::from_utf8(output.stderr).expect("text"),
    }
}

/// Runs, and expects success with nothing on standard error.
fn done(folder: &Path, arguments: &[&str]) -> String {
    let ran = run(folder, arguments);
    assert_eq!((ran.status, ran.err.as_str()), (0, ""), "{arguments:?}");
    ran.out
}

/// Runs, and expects failure: nothing on standard output, one line with all of `says` on standard error.
fn fails(folder: &Path, status: i32, arguments: &[&str], says: &[&str]) {
    let ran = run(folder, arguments);
    assert_eq!(ran.status, status, "{arguments:?}: {}", ran.err);
    assert_eq!(ran.out, "", "{arguments:?}");
    assert!(
        ran.err.starts_with("clipscape: ") && ran.err.ends_with('\n'),
        "{arguments:?}: {}",
        ran.err
    );
    assert_eq!(ran.err.lines().count(), 1, "{arguments:?}: {}", ran.err);
    for part in says {
        assert!(
            ran.err.contains(part),
            "{arguments:?}: {} should say {part}",
            ran.err
        );
    }
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn help_and_version_go_to_standard_output() {
    let folder = tempfile::tempdir().unwrap();
    let help = done(folder.path(), &["--help"]);
    for command in [
        "info",
        "preprocess",
        "Exit status: 0 done, 1 could not, 2 usage, 130 interrupted",
    ] {
        assert!(help.contains(command), "{help}");
    }
    assert!(done(folder.path(), &["preprocess", "--help"]).contains("--sky-directions"));
    assert!(done(folder.path(), &["info", "--help"]).contains("--verify"));
    assert_eq!(
        done(folder.path(), &["--version"]),
        format!("clipscape {}\n", env!("CARGO_PKG_VERSION"))
    );
}

#[test]
fn a_wrong_usage_is_status_2_and_one_line() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, says) in [
        (&[][..], "no command"),
        (&["flyy"], "unrecognized subcommand 'flyy'"),
        (&["info"], "<INPUT>"),
        (&["info", "a.tif", "--jsn"], "did you mean --json?"),
        (&["preprocess", "a.tif", "--sun", "10,100"], "-90 to 90"),
        (&["preprocess", "a.tif", "--memory", "lots"], "512M"),
        (
            &["preprocess", "a.tif", "--filter", "lanczos"],
            "did you mean lanczos3?",
        ),
        (
            &["preprocess", "a.tif", "--sky-directions", "-1"],
            "--sky-directions",
        ),
        (
            &["preprocess", "a.tif", "--no-light", "--sun", "10,10"],
            "cannot be used with",
        ),
    ] {
        fails(folder.path(), 2, arguments, &[says]);
    }
    assert!(names(folder.path()).is_empty());
}

#[test]
fn inputs_that_are_none_get_one_line_and_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    fs::write(
        here.join("text.tif"),
        "These are not the heights you are looking for.\n",
    )
    .unwrap();
    fs::write(here.join("empty.tif"), "").unwrap();
    for command in ["info", "preprocess"] {
        fails(here, 1, &[command, "none.tif"], &["none.tif: no such file"]);
        fails(here, 1, &[command, "text.tif"], &["text.tif: "]);
        fails(here, 1, &[command, "empty.tif"], &["empty.tif: "]);
        fails(here, 1, &[command, "synth:0"], &["synth:0"]);
        fails(here, 1, &[command, "."], &["./empty.tif: is empty"]);
    }
    assert_eq!(names(here), ["empty.tif", "text.tif"]);
}

#[cfg(feature = "dem")]
#[test]
fn a_tiff_that_ends_too_early_gets_one_line_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    done(here, &["synth", "300:7", "-o", "a.tif", "--quiet"]);
    let whole = fs::read(here.join("a.tif")).unwrap();
    for left in [whole.len() / 2, whole.len() - 1, 100, 8, 5] {
        fs::write(here.join("cut.tif"), &whole[..left]).unwrap();
        fails(
            here,
            1,
            &["preprocess", "cut.tif", "--no-light", "--quiet"],
            &["cut.tif: "],
        );
        fails(here, 1, &["info", "cut.tif"], &["cut.tif: "]);
    }
    assert_eq!(names(here), ["a.tif", "cut.tif"]);
    done(here, &["preprocess", "a.tif", "--no-light", "--quiet"]);
    assert_eq!(
        names(here),
        ["a.terrain.exr", "a.tif", "cut.tif"],
        "control: the whole one gives a file"
    );
}

#[test]
fn an_output_that_exists_stays_unless_forced() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    fs::write(here.join("o.terrain.exr"), "precious").unwrap();
    fs::write(here.join("s.json"), "precious").unwrap();
    let preprocess = [
        "preprocess",
        "synth:64",
        "--no-light",
        "--quiet",
        "-o",
        "o.terrain.exr",
    ];
    fails(here, 1, &preprocess, &["o.terrain.exr: ", "exists", "--force"]);
    let mut arguments = vec![
        "preprocess",
        "synth:64",
        "--no-light",
        "--quiet",
        "--stats",
        "s.json",
    ];
    fails(here, 1, &arguments, &["s.json: ", "exists", "--force"]);
    for name in ["o.terrain.exr", "s.json"] {
        assert_eq!(fs::read(here.join(name)).unwrap(), b"precious");
    }
    assert_eq!(names(here), ["o.terrain.exr", "s.json"]);

    arguments.extend(["--force", "-o", "o.terrain.exr"]);
    done(here, &arguments);
    assert!(fs::read(here.join("o.terrain.exr")).unwrap().len() > 1000);
    let stats: serde_json::Value = serde_json::from_slice(&fs::read(here.join("s.json")).unwrap()).unwrap();
    assert_eq!(stats["samples"], 64 * 64);
    assert!(stats["total_s"].as_f64().is_some_and(|s| s > 0.0), "{stats}");
    assert_eq!(names(here), ["o.terrain.exr", "s.json"]);
}

#[test]
fn a_folder_that_cannot_be_written_to_gets_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    // Below a regular file: even an administrator cannot write there.
    fs::write(here.join("file"), "text").unwrap();
    for output in ["file/o.terrain.exr", "none/o.terrain.exr"] {
        fails(
            here,
            1,
            &["preprocess", "synth:64", "--no-light", "-o", output],
            &[&format!("{output}: ")],
        );
    }
    let stats = ["preprocess", "synth:64", "--no-light", "--stats", "file/s.json"];
    fails(here, 1, &stats, &["file/s.json: "]);
    assert_eq!(names(here), ["file"]);
}

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
fn a_reader_that_stops_reading_is_no_failure() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [&["--help"][..], &["info", "synth:64"]] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let mut command = program();
        command
            .args(arguments)
            .current_dir(folder.path())
            .stdout(writer)
            .stderr(Stdio::piped());
        let output = command.spawn().unwrap().wait_with_output().unwrap();
        let err = String::from_utf8(output.stderr).unwrap();
        assert_eq!(
            (output.status.code(), err.as_str()),
            (Some(0), ""),
            "{arguments:?}"
        );
    }
}

#[cfg(unix)]
#[test]
fn an_interrupt_is_status_130_and_leaves_nothing() {
    use std::time::{Duration, Instant};
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let arguments = [
        "preprocess",
        "synth:2000",
        "--sky-directions",
        "3600",
        "-o",
        "o.terrain.exr",
    ];
    let mut command = program();
    command
        .args(arguments)
        .current_dir(here)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let child = command.spawn().unwrap();
    let begun = Instant::now();
    while names(here).is_empty() {
        assert!(begun.elapsed() < Duration::from_secs(60), "the work never began");
        std::thread::sleep(Duration::from_millis(20));
    }
    let id = child.id().to_string();
    assert!(
        Command::new("sh")
            .args(["-c", "kill -INT \"$1\"", "sh", &id])
            .status()
            .unwrap()
            .success()
    );
    let output = child.wait_with_output().unwrap();
    let err = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(130), "{err}");
    assert!(err.lines().count() == 1 && err.contains("interrupted"), "{err}");
    assert!(names(here).is_empty(), "{:?}", names(here));
}

/// Kills at random moments: `CLIPSCAPE_KILLS=200` is the long form.
#[cfg(target_os = "linux")]
#[test]
fn a_kill_at_any_moment_leaves_no_file_under_the_name_and_the_next_run_cleans_up() {
    use std::time::{Duration, Instant};
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let arguments = [
        "preprocess",
        "synth:1200",
        "--no-light",
        "-o",
        "o.terrain.exr",
        "--quiet",
    ];
    let begun = Instant::now();
    done(here, &arguments);
    let whole = begun.elapsed();
    let want = fs::read(here.join("o.terrain.exr")).unwrap();
    fs::remove_file(here.join("o.terrain.exr")).unwrap();
    let kills = std::env::var("CLIPSCAPE_KILLS")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(8u32);
    let (mut killed, mut seed) = (0, 17u64);
    for n in 0..kills {
        // Knuth's generator is random enough for moments.
        seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let share = (seed >> 11) as f64 / (1u64 << 53) as f64;
        let mut child = program().args(arguments).current_dir(here).spawn().unwrap();
        std::thread::sleep(Duration::from_secs_f64(whole.as_secs_f64() * share));
        child.kill().unwrap();
        let status = child.wait().unwrap();
        let there = names(here);
        let published = there.iter().any(|name| name == "o.terrain.exr");
        // Whole, or not at all; a run may be killed after it has given the file its name.
        assert!(!status.success() || published, "kill {n}, seed 17: {there:?}");
        if published {
            assert!(
                fs::read(here.join("o.terrain.exr")).unwrap() == want,
                "kill {n}, seed 17"
            );
            fs::remove_file(here.join("o.terrain.exr")).unwrap();
        }
        killed += usize::from(!published && !there.is_empty());
        assert!(
            there.len() < 3,
            "kill {n}, seed 17: what was left before is not removed: {there:?}"
        );
    }
    assert!(killed > 0, "no kill met a run at its work");
    done(here, &arguments);
    assert_eq!(names(here), ["o.terrain.exr"]);
    assert!(fs::read(here.join("o.terrain.exr")).unwrap() == want);
    done(here, &["info", "o.terrain.exr", "--verify", "--quiet"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_source_that_is_cut_short_or_gone_gets_one_line_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    done(here, &["synth", "600", "-o", "a.tif", "--quiet"]);
    // The samples are cut off after the header: what vanished is found only while it is read.
    let file = fs::OpenOptions::new()
        .write(true)
        .open(here.join("a.tif"))
        .unwrap();
    file.set_len(file.metadata().unwrap().len() / 2).unwrap();
    fails(
        here,
        1,
        &["preprocess", "a.tif", "--no-light", "-o", "o.terrain.exr"],
        &["a.tif"],
    );
    fails(
        here,
        1,
        &["preprocess", "b.tif", "-o", "o.terrain.exr"],
        &["b.tif"],
    );
    assert_eq!(names(here), ["a.tif"]);
}

#[cfg(feature = "gpu")]
#[test]
fn render_refuses_at_once_what_it_could_only_spoil() {
    let folder = tempfile::tempdir().unwrap();
    let grid = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 30\n1 2 3\n4 5 6\n";
    fs::write(folder.path().join("a.asc"), grid).unwrap();
    for (arguments, says) in [
        ("render a.asc -o a.asc --force", "a.asc: is an input"),
        (
            "render a.asc -o b.png --stats a.asc --force",
            "a.asc: is an input",
        ),
        ("render a.asc -o b.png --stats b.png", "b.png: is asked for twice"),
        ("render a.asc -o b.png --size 9000x10", "a size of 9000x10 pixels"),
        (
            "render a.asc -o f --flight orbit --frames 5..900",
            "frames: frames 5..900",
        ),
    ] {
        let words: Vec<&str> = arguments.split(' ').collect();
        let ran = run(folder.path(), &words);
        assert_eq!(ran.status, 1, "{arguments}: {}", ran.err);
        assert!(
            ran.err.contains(says) && ran.err.lines().count() == 1,
            "{arguments}: {}",
            ran.err
        );
    }
    let huge = grid.replace('6', "-1e38");
    fs::write(folder.path().join("huge.asc"), huge).unwrap();
    if clipscape::gpu::open().is_ok() {
        let says = ["huge.asc: has heights of -1.0e38 m", "--nodata"];
        fails(folder.path(), 1, &["render", "huge.asc", "-o", "b.png"], &says);
    }
    fs::remove_file(folder.path().join("huge.asc")).unwrap();
    for (arguments, says) in [
        ("--clip-size 64 --transition 99", "transition: 99 steps"),
        ("--upload-budget 1M", "set wait to none"),
        ("--clip-size auto", "give --max-error-px too"),
    ] {
        let words: Vec<&str> = "render a.asc -o b.png"
            .split(' ')
            .chain(arguments.split(' '))
            .collect();
        fails(folder.path(), 2, &words, &[says]);
    }
    assert_eq!(fs::read_to_string(folder.path().join("a.asc")).unwrap(), grid);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left");
}

#[cfg(feature = "gpu")]
#[test]
fn the_whole_dem_is_in_the_picture_at_any_vertical_scale() {
    if clipscape::gpu::open().is_err() {
        return; // The tests of the GPU say that there is none, and fail where one is required.
    }
    let folder = tempfile::tempdir().unwrap();
    for scale in ["0.1", "1", "10", "1000", "-2"] {
        let out = format!("z{scale}.png");
        let ran = run(
            folder.path(),
            &[
                "render",
                "synth:300",
                "-z",
                scale,
                "-o",
                &out,
                "--size",
                "64x48",
                "--stats",
                "s",
                "-f",
            ],
        );
        assert_eq!(ran.status, 0, "{scale}: {}", ran.err);
        let stats = fs::read_to_string(folder.path().join("s")).unwrap();
        let frame: serde_json::Value = serde_json::from_str(stats.lines().next().unwrap()).unwrap();
        assert_eq!(frame["patches_culled"], 0, "{scale}: {frame}");
        assert!(frame["patches"].as_u64().unwrap() > 0, "{scale}: {frame}");
        assert!(!ran.err.contains("no terrain is seen"), "{scale}: {}", ran.err);
    }
    let ran = run(
        folder.path(),
        &[
            "render",
            "synth:300",
            "--eye",
            "0,9e9,0",
            "--pitch",
            "90",
            "-o",
            "no.png",
        ],
    );
    assert!(
        ran.status == 0 && ran.err.contains("no terrain is seen"),
        "{}",
        ran.err
    );
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
