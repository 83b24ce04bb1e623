//! One posture with what was measured in it, and the file that it stands in.

use super::frame::Frame;
use super::kind::{Kind, Purpose};
use super::pixels::Optics;
use crate::error::Error;
use nalgebra::{Matrix6, Vector3};
use std::path::Path;

/// What an instrument said of one posture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// the robot was held by what it touched
    Contact,
    /// point in the tracker's frame, m
    Position(Vector3<f64>),
    /// target in the camera's frame
    Pose(Frame),
    /// dial gauge, m
    Reading(f64),
}

/// One posture.
#[derive(Debug, Clone)]
pub struct Row {
    /// index of its measurement
    pub measurement: usize,
    /// line in the file
    pub line: usize,
    /// joint readings, rad or m
    pub q: Vec<f64>,
    /// what was measured
    pub value: Value,
    /// of position (m) and rotation vector (rad) in the camera's axes
    pub covariance: Option<Matrix6<f64>>,
    /// side that each joint came from: 1 where its reading rose; empty where nothing is said
    pub approach: Vec<f64>,
    /// whether unknowns are identified with it
    pub fit: bool,
}

/// Which file, of what, by whom.
pub struct Source<'a> {
    /// the file
    pub path: &'a Path,
    /// what was measured
    pub kind: Kind,
    /// camera and target, where the measurement is of pictures
    pub optics: Option<&'a Optics>,
    /// joints whose readings stand in it
    pub joints: &'a [String],
    /// index of the measurement
    pub measurement: usize,
    /// what its rows are for, where they do not say so themselves
    pub purpose: Option<Purpose>,
}

impl Source<'_> {
    /// An error in a line of it.
    pub fn bad(&self, line: usize, message: impl Into<String>) -> Error {
        Error::file(self.path, format!("line {line}"), message.into())
    }
}
