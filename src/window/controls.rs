//! Keys and what they do: one table, from which input is understood and the help is written.

use winit::keyboard::KeyCode;

use super::settings::Dial;
use crate::shade::ViewMode;

/// A way of moving or looking, for as long as its key is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Motion {
    Forward,
    Back,
    Left,
    Right,
    Up,
    Down,
    TurnLeft,
    TurnRight,
    LookUp,
    LookDown,
    Fast,
    Slow,
}

impl Motion {
    const COUNT: usize = Self::Slow as usize + 1;
}

/// Something that happens once a key goes down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Action {
    WholeView,
    FullScreen,
    Leave,
    Help,
    Panel,
    Capture,
    BelowGround,
    Record,
    Picture,
    Faster,
    Slower,
    Show(ViewMode),
    Tint,
    Haze,
    Turn(Dial),
}

impl Action {
    /// Whether a key that is held down goes on doing it.
    pub(super) fn repeats(self) -> bool {
        matches!(self, Self::Faster | Self::Slower | Self::Turn(_))
    }
}

/// What a key does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Does {
    Move(Motion),
    Act(Action),
}

/// A line of the help: keys that do one thing.
pub(super) struct Binding {
    /// The keys, by their place on a US keyboard.
    pub(super) codes: &'static [KeyCode],
    /// How the help calls them.
    pub(super) keys: &'static str,
    /// What they do, in words.
    pub(super) words: &'static str,
    pub(super) does: Does,
}

const fn moves(
    codes: &'static [KeyCode],
    keys: &'static str,
    words: &'static str,
    motion: Motion,
) -> Binding {
    Binding {
        codes,
        keys,
        words,
        does: Does::Move(motion),
    }
}

const fn acts(codes: &'static [KeyCode], keys: &'static str, words: &'static str, action: Action) -> Binding {
    Binding {
        codes,
        keys,
        words,
        does: Does::Act(action),
    }
}

/// All keys, in the order of the help.
pub(super) const BINDINGS: &[Binding] = &[
    moves(
        &[KeyCode::KeyW, KeyCode::ArrowUp],
        "W, Up",
        "forward",
        Motion::Forward,
    ),
    moves(
        &[KeyCode::KeyS, KeyCode::ArrowDown],
        "S, Down",
        "back",
        Motion::Back,
    ),
    moves(
        &[KeyCode::KeyA, KeyCode::ArrowLeft],
        "A, Left",
        "left",
        Motion::Left,
    ),
    moves(
        &[KeyCode::KeyD, KeyCode::ArrowRight],
        "D, Right",
        "right",
        Motion::Right,
    ),
    moves(&[KeyCode::KeyE, KeyCode::PageUp], "E, Page Up", "up", Motion::Up),
    moves(
        &[KeyCode::KeyQ, KeyCode::PageDown],
        "Q, Page Down",
        "down",
        Motion::Down,
    ),
    moves(&[KeyCode::KeyJ], "J", "turn left", Motion::TurnLeft),
    moves(&[KeyCode::KeyL], "L", "turn right", Motion::TurnRight),
    moves(&[KeyCode::KeyI], "I", "look up", Motion::LookUp),
    moves(&[KeyCode::KeyK], "K", "look down", Motion::LookDown),
    moves(
        &[KeyCode::ShiftLeft, KeyCode::ShiftRight],
        "Shift",
        "four times as fast",
        Motion::Fast,
    ),
    moves(
        &[KeyCode::ControlLeft, KeyCode::ControlRight],
        "Ctrl",
        "a quarter as fast",
        Motion::Slow,
    ),
    acts(
        &[KeyCode::Equal, KeyCode::NumpadAdd],
        "+, wheel up",
        "faster from now on",
        Action::Faster,
    ),
    acts(
        &[KeyCode::Minus, KeyCode::NumpadSubtract],
        "-, wheel down",
        "slower from now on",
        Action::Slower,
    ),
    acts(&[KeyCode::Home], "Home", "show the whole", Action::WholeView),
    acts(
        &[KeyCode::KeyM],
        "M",
        "hold the mouse, to look without a button; again lets it go",
        Action::Capture,
    ),
    acts(
        &[KeyCode::KeyG],
        "G",
        "allow the camera below the ground, or not",
        Action::BelowGround,
    ),
    acts(
        &[KeyCode::Digit1, KeyCode::Numpad1],
        "1",
        "shaded",
        Action::Show(ViewMode::Shaded),
    ),
    acts(
        &[KeyCode::Digit2, KeyCode::Numpad2],
        "2",
        "the bare light",
        Action::Show(ViewMode::Light),
    ),
    acts(
        &[KeyCode::Digit3, KeyCode::Numpad3],
        "3",
        "levels",
        Action::Show(ViewMode::Level),
    ),
    acts(
        &[KeyCode::Digit4, KeyCode::Numpad4],
        "4",
        "triangles",
        Action::Show(ViewMode::Wire),
    ),
    acts(
        &[KeyCode::Digit5, KeyCode::Numpad5],
        "5",
        "errors, measured once the camera rests",
        Action::Show(ViewMode::Error),
    ),
    acts(&[KeyCode::KeyT], "T", "tint", Action::Tint),
    acts(&[KeyCode::KeyY], "Y", "haze", Action::Haze),
    acts(
        &[KeyCode::KeyX],
        "X",
        "promised error, with Shift less",
        Action::Turn(Dial::MaxError),
    ),
    acts(
        &[KeyCode::KeyC],
        "C",
        "clip size, with Shift less",
        Action::Turn(Dial::ClipSize),
    ),
    acts(
        &[KeyCode::KeyB],
        "B",
        "transition band, with Shift less",
        Action::Turn(Dial::Transition),
    ),
    acts(
        &[KeyCode::KeyV],
        "V",
        "exaggeration, with Shift less",
        Action::Turn(Dial::Exaggeration),
    ),
    acts(
        &[KeyCode::KeyU],
        "U",
        "the sun's azimuth, or the time of day, with Shift back",
        Action::Turn(Dial::SunAzimuth),
    ),
    acts(
        &[KeyCode::KeyO],
        "O",
        "the sun's altitude, with Shift down",
        Action::Turn(Dial::SunAltitude),
    ),
    acts(
        &[KeyCode::KeyR],
        "R",
        "record a flight; again writes it",
        Action::Record,
    ),
    acts(&[KeyCode::KeyP], "P", "write a picture", Action::Picture),
    acts(&[KeyCode::Tab], "Tab", "the panel", Action::Panel),
    acts(&[KeyCode::KeyH, KeyCode::F1], "H, F1", "this help", Action::Help),
    acts(
        &[KeyCode::KeyF, KeyCode::F11],
        "F, F11",
        "full screen",
        Action::FullScreen,
    ),
    acts(
        &[KeyCode::Escape],
        "Esc",
        "let the mouse go, leave the help or full screen, else quit",
        Action::Leave,
    ),
];

/// What a key does, if anything.
pub(super) fn does(code: KeyCode) -> Option<Does> {
    let binding = BINDINGS.iter().find(|b| b.codes.contains(&code));
    binding.map(|b| b.does)
}

/// The motions whose keys are down. A motion may have several keys, each of which may be down.
#[derive(Clone, Debug, Default)]
pub(super) struct Held {
    codes: Vec<KeyCode>,
}

impl Held {
    /// A motion's key goes down or up.
    pub(super) fn set(&mut self, code: KeyCode, down: bool) {
        self.codes.retain(|&c| c != code);
        if down {
            self.codes.push(code);
        }
    }

    /// All keys are let go: their releases are not heard once the window has lost the keyboard.
    pub(super) fn clear(&mut self) {
        self.codes.clear();
    }

    /// Whether a motion's key is down.
    pub(super) fn is(&self, motion: Motion) -> bool {
        self.motions()[motion as usize]
    }

    /// 1, -1 or 0: the first motion, the second, neither or both.
    pub(super) fn axis(&self, plus: Motion, minus: Motion) -> f64 {
        f64::from(u8::from(self.is(plus))) - f64::from(u8::from(self.is(minus)))
    }

    fn motions(&self) -> [bool; Motion::COUNT] {
        let mut held = [false; Motion::COUNT];
        for &code in &self.codes {
            if let Some(Does::Move(motion)) = does(code) {
                held[motion as usize] = true;
            }
        }
        held
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_key_does_one_thing_and_all_things_have_a_key() {
        let codes: Vec<KeyCode> = BINDINGS.iter().flat_map(|b| b.codes).copied().collect();
        for (k, code) in codes.iter().enumerate() {
            assert!(!codes[..k].contains(code), "{code:?} does two things");
        }
        for (k, binding) in BINDINGS.iter().enumerate() {
            assert!(!binding.codes.is_empty() && !binding.words.is_empty());
            assert!(
                BINDINGS[..k].iter().all(|b| b.does != binding.does),
                "{:?} stands twice",
                binding.does
            );
        }
        for (_, mode) in ViewMode::NAMED {
            let show = Does::Act(Action::Show(mode));
            assert!(BINDINGS.iter().any(|b| b.does == show), "{mode:?}");
        }
        for dial in Dial::ALL {
            let turn = Does::Act(Action::Turn(dial));
            assert!(BINDINGS.iter().any(|b| b.does == turn), "{dial:?}");
        }
    }

    #[test]
    fn held_keys_add_up_and_cancel_out() {
        let mut held = Held::default();
        assert_eq!(held.axis(Motion::Forward, Motion::Back), 0.0);
        held.set(KeyCode::KeyW, true);
        held.set(KeyCode::ArrowUp, true);
        held.set(KeyCode::KeyW, true); // a key that repeats
        assert_eq!(held.axis(Motion::Forward, Motion::Back), 1.0);
        held.set(KeyCode::KeyW, false);
        assert_eq!(
            held.axis(Motion::Forward, Motion::Back),
            1.0,
            "the arrow is still down"
        );
        held.set(KeyCode::KeyS, true);
        assert_eq!(held.axis(Motion::Forward, Motion::Back), 0.0);
        held.set(KeyCode::ArrowUp, false);
        assert_eq!(held.axis(Motion::Forward, Motion::Back), -1.0);
        held.clear();
        assert!(!held.is(Motion::Back));
    }

    #[test]
    fn what_writes_files_does_not_repeat() {
        assert!(Action::Faster.repeats() && Action::Turn(Dial::ClipSize).repeats());
        for action in [
            Action::Record,
            Action::Picture,
            Action::FullScreen,
            Action::Leave,
            Action::Tint,
        ] {
            assert!(!action.repeats(), "{action:?}");
        }
    }
}
