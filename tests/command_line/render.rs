//! What `render` refuses and what it shows.

use std::fs;

use crate::{fails, run};

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
