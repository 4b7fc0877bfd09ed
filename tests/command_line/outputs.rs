//! Outputs are whole or not there: what exists, full folders, interrupts, kills, sources that go.

use std::fs;
use std::process::{Command, Stdio};

use crate::{done, fails, names, program};

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
