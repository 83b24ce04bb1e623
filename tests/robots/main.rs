//! Robots: files, trees, base parameters, and identities of their dynamics.

#[path = "../common/mod.rs"]
mod common;

mod base;
mod collision;
mod export;
mod files;
mod geometry;
mod identities;
mod into;
mod mjcf;
mod plant;
mod rank;
mod reference;
mod tree;
