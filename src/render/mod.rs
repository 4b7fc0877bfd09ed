//! Headless frames and what is made of them: pictures, a contact sheet, an animation.

pub mod pictures;
