//! Hexapods whose effect is withheld: legs with mass, friction, encoders, coloured noise.

pub mod case;
pub mod drives;
pub mod files;
pub mod hexapod;
pub mod machine;
pub mod plan;
pub mod sines;
