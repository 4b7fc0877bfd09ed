//! The window as a user meets it: opened on a screen without a monitor, driven by keys and mouse, and closed.
//!
//! Needs Linux with Xvfb and xdotool (Debian's packages of these names), and says so where they are missing; with
//! `CLIPSCAPE_REQUIRE_WINDOW=1` that is a failure.
//!
//! Ten minutes of random input, of which the smoke test does a few seconds:
//!
//!     CLIPSCAPE_WINDOW_MINUTES=10 CLIPSCAPE_SEED=1 cargo test --release --test window random -- --nocapture
#![cfg(all(feature = "window", feature = "cli", target_os = "linux"))]
#![allow(
    clippy::print_stderr,
    reason = "a test says why it is skipped, and what it drew by chance"
)]

mod pictures;
mod screen;
#[path = "../support/mod.rs"]
mod support;

use std::fs;
use std::io::Read;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use clipscape::Flight;
use pictures::{FAR, FAR_SHARE_LIMIT, MEAN_LIMIT, difference, pixels};
use screen::{Screen, Window};
use support::{Random, seed};

#[test]
fn a_recorded_flight_is_replayed_to_the_picture_that_was_seen() {
    let Some(screen) = Screen::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--clip-size", "128"];
    let window = Window::open(&screen, "synth:1024:3", "800x500", folder.path(), &arguments);
    let first = window.picture();
    assert_eq!(first, folder.path().join("synth-1024-3-001.png"));

    screen.key("r");
    for key in ["w", "d", "Up"] {
        screen.send(&["keydown", key]);
        sleep(Duration::from_millis(400));
        screen.send(&["keyup", key]);
    }
    screen.send(&["mousemove", "600", "250", "mousedown", "1"]);
    for _ in 0..5 {
        screen.send(&["mousemove_relative", "--sync", "--", "12", "-3"]);
    }
    screen.send(&["mouseup", "1", "click", "4", "click", "5"]);
    // It comes to rest.
    sleep(Duration::from_millis(1500));
    let seen = window.picture();
    let line = window.press_until("r", |line| line.contains("to replay it: "));
    let (status, rest) = window.quit();
    assert_eq!(status, Some(0), "{rest:?}");
    assert!(rest.is_empty(), "{rest:?}");

    let json = fs::read_to_string(folder.path().join("synth-1024-3-001.json")).unwrap();
    let flight = Flight::parse("the flight", &json).unwrap();
    let last = flight.frame_count() - 1;
    let (from, to) = (flight.camera_at_frame(0), flight.camera_at_frame(last));
    assert!(from.eye.distance(to.eye) > 10.0, "keys move: {from:?} {to:?}");
    assert!(
        (from.heading_deg - to.heading_deg).abs() > 1.0,
        "the mouse turns: {from:?} {to:?}"
    );

    let (_, command) = line.split_once("to replay it: clipscape ").expect("a command");
    let frames = folder.path().join("frames");
    let render = Command::new(env!("CARGO_BIN_EXE_clipscape"))
        .args(command.split_whitespace())
        .args(["--frames", &format!("{last}..{}", last + 1), "-o"])
        .arg(&frames)
        .output()
        .unwrap();
    assert!(
        render.status.success(),
        "{}",
        String::from_utf8_lossy(&render.stderr)
    );
    let replayed = frames.join(format!("{last:05}.png"));
    let (mean, far) = difference(&replayed, &seen);
    eprintln!(
        "replayed and seen differ by {mean:.4} of 255 in the mean, {:.3} % by more than {FAR}",
        100.0 * far
    );
    assert!(mean <= MEAN_LIMIT && far <= FAR_SHARE_LIMIT, "{mean} {far}");
    let (mean, far) = difference(&replayed, &first);
    assert!(
        mean > MEAN_LIMIT && far > FAR_SHARE_LIMIT,
        "control, another pose: {mean} {far}"
    );
}

#[test]
fn on_a_screen_of_fine_pixels_pictures_are_as_large_as_asked_for_and_the_window_is_resized() {
    let Some(screen) = Screen::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--clip-size", "64"];
    let window = Window::open_scaled(&screen, 2.0, "synth:1024:3", "800x500", folder.path(), &arguments);
    let (width, height, _) = pixels(&window.picture());
    assert_eq!([width, height], [800, 500]);
    let id = screen.send(&["search", "--onlyvisible", "--name", "^clipscape: "]);
    let id = id.lines().next().expect("a window");
    for size in [[333, 217], [1, 1], [900, 600]] {
        let [w, h] = size.map(|s: u32| s.to_string());
        screen.send(&["windowsize", "--sync", id, &w, &h]);
        let (width, height, _) = pixels(&window.picture());
        assert_eq!([width, height], size);
    }
    let (status, rest) = window.quit();
    assert_eq!(status, Some(0), "{rest:?}");
}

#[test]
fn a_lost_device_is_replaced_once_and_a_second_loss_ends_it() {
    let Some(screen) = Screen::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--clip-size", "64", "--loses-device"];
    let mut window = Window::open(&screen, "synth:1024:3", "640x400", folder.path(), &arguments);
    let before = window.picture();
    let line = window.press_until("F12", |line| line.contains("was lost"));
    assert_eq!(line, "clipscape: The graphics device was lost, and replaced");
    let after = window.picture();
    let (mean, far) = difference(&before, &after);
    assert!(
        mean == 0.0 && far == 0.0,
        "the same is seen as before: {mean} {far}"
    );

    let line = window.press_until("F12", |line| line.contains("was lost"));
    assert!(line.contains("lost twice in short order"), "{line}");
    assert!(line.contains("clipscape render"), "{line}");
    let status = window.program.wait().unwrap();
    assert_eq!(status.code(), Some(1));
}

/// Random keys, drags, wheel and clicks. What quits or fills the disk is left out; the clip size is, for it is meant to
/// change how much memory is taken.
fn play(screen: &Screen, random: &mut Random) {
    const KEYS: [&str; 33] = [
        "w", "a", "s", "d", "q", "e", "i", "j", "k", "l", "Up", "Down", "Left", "Right", "Home", "1", "2",
        "3", "4", "t", "y", "x", "b", "v", "u", "o", "h", "Tab", "m", "g", "plus", "minus", "f",
    ];
    match random.bits() % 8 {
        0..=4 => {
            let key = random.pick(&KEYS);
            let shift = random.bits().is_multiple_of(3);
            if shift {
                screen.send(&["keydown", "shift"]);
            }
            screen.send(&["keydown", key]);
            sleep(Duration::from_millis(random.bits() % 400));
            screen.send(&["keyup", key, "keyup", "shift"]);
        }
        5 | 6 => {
            let at = [random.bits() % 800, random.bits() % 500].map(|v| v.to_string());
            let by = [random.bits() % 300, random.bits() % 200].map(|v| (v as i64 - 120).to_string());
            screen.send(&["mousemove", &at[0], &at[1], "mousedown", "1"]);
            screen.send(&["mousemove_relative", "--", &by[0], &by[1]]);
            screen.send(&["mouseup", "1"]);
        }
        _ => {
            let button = if random.bits().is_multiple_of(2) { "4" } else { "5" };
            screen.send(&["click", "--repeat", "3", button]);
        }
    }
}

#[test]
fn random_input_neither_ends_it_nor_fills_the_memory() {
    let Some(screen) = Screen::start() else { return };
    let minutes = std::env::var("CLIPSCAPE_WINDOW_MINUTES").ok();
    let minutes = minutes.and_then(|m| m.parse::<f64>().ok());
    let length = Duration::from_secs_f64(60.0 * minutes.unwrap_or(0.1));
    let seed = seed(16);
    eprintln!("seed {seed}, {:.0} s", length.as_secs_f64());
    let mut random = Random(seed);
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--clip-size", "64"];
    let mut window = Window::open(&screen, "synth:4096:3", "800x500", folder.path(), &arguments);
    window.picture();
    let start = Instant::now();
    let mut resident = Vec::new();
    while start.elapsed() < length {
        play(&screen, &mut random);
        let ended = window.program.try_wait().expect("it is a child");
        assert!(
            ended.is_none(),
            "it has ended: {ended:?}, {:?}",
            window.lines.try_iter().collect::<Vec<_>>()
        );
        resident.push(window.resident_bytes());
    }
    let most = |part: &[u64]| part.iter().max().copied().unwrap_or_default() >> 20;
    let thirds: Vec<u64> = resident.chunks(resident.len().div_ceil(3)).map(most).collect();
    eprintln!(
        "{} inputs; most memory in each third: {thirds:?} MiB",
        resident.len()
    );
    if minutes.is_some_and(|m| m >= 3.0) {
        // The first third makes all pipelines, and meets the terrain that the budget of tiles holds.
        assert!(
            thirds[2] <= thirds[1] + thirds[1] / 20 + 16,
            "it grows: {thirds:?} MiB"
        );
    }
    // It may be in full screen, in the help, or hold the mouse: Esc leaves these first.
    for _ in 0..4 {
        if window.program.try_wait().expect("it is a child").is_none() {
            screen.key("Escape");
            sleep(Duration::from_millis(1000));
        }
    }
    let (status, rest) = window.quit();
    assert_eq!(status, Some(0), "{rest:?}");
}

#[test]
fn without_a_display_one_line_says_what_to_do_instead() {
    let run = |arguments: &[&str]| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_clipscape"))
            .arg("fly")
            .args(arguments)
            .env_remove("DISPLAY")
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET")
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut said = String::new();
        program.stderr.take().unwrap().read_to_string(&mut said).unwrap();
        (program.wait().unwrap().code(), said)
    };
    let (status, said) = run(&["synth:64"]);
    assert_eq!(status, Some(1), "{said}");
    assert!(
        said.starts_with("clipscape: display: ") && said.lines().count() == 1,
        "{said}"
    );
    assert!(said.contains("clipscape render"), "{said}");
    // What is wrong with what was typed is said first.
    for (arguments, status, says) in [
        (&["missing.tif"][..], 1, "missing.tif"),
        (&["synth:64", "--output-dir", "missing"], 1, "missing"),
        (&["synth:64", "--clip-size", "auto"], 2, "--clip-size"),
        (&["synth:64", "--stats", "a"], 2, "--stats"),
        (
            &["synth:64", "--wait", "all", "--upload-budget", "1M"],
            2,
            "upload budget",
        ),
    ] {
        let (code, said) = run(arguments);
        assert_eq!(code, Some(status), "{arguments:?}: {said}");
        assert!(
            said.contains(says) && said.lines().count() == 1,
            "{arguments:?}: {said}"
        );
    }
}
