//! clipmap
