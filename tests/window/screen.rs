//! A screen without a monitor, and the program with its window on it.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::support::gpu;

/// How long anything may take here, on a machine that does other things too.
const PATIENCE: Duration = Duration::from_secs(240);

/// A screen without a monitor; gone when dropped.
pub(crate) struct Screen {
    server: Child,
    display: String,
}

impl Screen {
    /// Starts one on a number that is free, or says why not.
    pub(crate) fn start() -> Option<Self> {
        let missing = |what: &str| {
            let required = std::env::var_os("CLIPSCAPE_REQUIRE_WINDOW").is_some_and(|v| v == "1");
            assert!(!required, "CLIPSCAPE_REQUIRE_WINDOW is set, but {what}");
            eprintln!("skipped: {what}");
            None
        };
        gpu()?;
        if Command::new("xdotool").arg("version").output().is_err() {
            return missing("there is no xdotool");
        }
        let server = Command::new("Xvfb")
            .args([
                "-displayfd",
                "1",
                "-screen",
                "0",
                "1024x768x24",
                "-nolisten",
                "tcp",
            ])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let Ok(mut server) = server else {
            return missing("there is no Xvfb");
        };
        let mut number = String::new();
        let mut out = BufReader::new(server.stdout.take().expect("it is piped"));
        out.read_line(&mut number).expect("Xvfb says its number");
        let display = format!(":{}", number.trim());
        Some(Self { server, display })
    }

    /// Sends input.
    pub(crate) fn send(&self, words: &[&str]) -> String {
        let output = Command::new("xdotool")
            .args(words)
            .env("DISPLAY", &self.display)
            .output()
            .expect("xdotool starts");
        String::from_utf8(output.stdout).expect("text")
    }

    pub(crate) fn key(&self, key: &str) {
        self.send(&["key", key]);
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// The program with its window; ended when dropped.
pub(crate) struct Window<'a> {
    screen: &'a Screen,
    pub(crate) program: Child,
    pub(crate) lines: Receiver<String>,
}

impl<'a> Window<'a> {
    /// Flies over `input` as a user would in a window of `size` pixels, writing into `folder`, and waits until there is a
    /// window that hears keys. `arguments` come last.
    pub(crate) fn open(
        screen: &'a Screen,
        input: &str,
        size: &str,
        folder: &Path,
        arguments: &[&str],
    ) -> Self {
        Self::open_scaled(screen, 1.0, input, size, folder, arguments)
    }

    /// The same on a screen whose points are `scale` pixels wide.
    pub(crate) fn open_scaled(
        screen: &'a Screen,
        scale: f64,
        input: &str,
        size: &str,
        folder: &Path,
        arguments: &[&str],
    ) -> Self {
        let mut program = Command::new(env!("CARGO_BIN_EXE_clipscape"))
            .args(["fly", input, "--size", size, "--output-dir"])
            .arg(folder)
            .args(arguments)
            .env("WINIT_X11_SCALE_FACTOR", scale.to_string())
            .env("DISPLAY", &screen.display)
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET")
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let err = BufReader::new(program.stderr.take().expect("it is piped"));
        let (say, lines) = channel();
        std::thread::spawn(move || {
            err.lines()
                .map_while(Result::ok)
                .try_for_each(|line| say.send(line))
        });
        let window = Self {
            screen,
            program,
            lines,
        };
        let start = Instant::now();
        let id = loop {
            let found = screen.send(&["search", "--onlyvisible", "--name", "^clipscape: "]);
            if let Some(id) = found.lines().next() {
                break id.to_string();
            }
            assert!(start.elapsed() < PATIENCE, "no window appears");
            sleep(Duration::from_millis(100));
        };
        // Without a window manager nobody gives it the keyboard.
        screen.send(&["windowfocus", "--sync", &id]);
        window
    }

    /// Presses a key until a line says what it is to say: before the terrain is there, keys do nothing.
    pub(crate) fn press_until(&self, key: &str, says: impl Fn(&str) -> bool) -> String {
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            self.screen.key(key);
            let until = Instant::now() + Duration::from_secs(3);
            while let Ok(line) = self.lines.recv_timeout(until - Instant::now().min(until)) {
                if says(&line) {
                    return line;
                }
            }
        }
        panic!("{key} is without effect");
    }

    /// A picture of all that is to be seen, once it is.
    pub(crate) fn picture(&self) -> PathBuf {
        let line = self.press_until("p", |line| line.ends_with(".png is written"));
        let path = line.strip_prefix("clipscape: ").expect("it is the program's");
        PathBuf::from(path.strip_suffix(" is written").expect("it ends so"))
    }

    /// Its memory in bytes, as the system counts what is resident.
    pub(crate) fn resident_bytes(&self) -> u64 {
        let status = fs::read_to_string(format!("/proc/{}/status", self.program.id())).expect("it runs");
        let line = status
            .lines()
            .find(|l| l.starts_with("VmRSS:"))
            .expect("it has memory");
        let kib = line.split_whitespace().nth(1).and_then(|n| n.parse::<u64>().ok());
        1024 * kib.expect("a number")
    }

    /// Quits, and returns the exit status and what else was said.
    pub(crate) fn quit(mut self) -> (Option<i32>, Vec<String>) {
        self.screen.key("Escape");
        let start = Instant::now();
        let status = loop {
            if let Some(status) = self.program.try_wait().expect("it is a child") {
                break status;
            }
            assert!(start.elapsed() < PATIENCE, "it does not quit");
            sleep(Duration::from_millis(50));
        };
        (status.code(), self.lines.try_iter().collect())
    }
}

impl Drop for Window<'_> {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}
