//! One error type for the whole library, and the warnings that travel to the report.
//!
//! Every message names the file, line, joint or argument it is about and says what to do.
//! Numerical outcomes (a design that stalled, a fit that is poor) are *not* errors: they are
//! statuses in the results.

use std::path::{Path, PathBuf};

/// Names for a message: the first of them, and nothing that a terminal obeys.
pub(crate) fn listed(names: &[String]) -> String {
    const SHOWN: usize = 200;
    let all: String = names.join(",").escape_debug().collect();
    match all.chars().count() > SHOWN {
        true => format!("{}…", all.chars().take(SHOWN).collect::<String>()),
        false => all,
    }
}

/// `1 gap`, `3 gaps`.
pub(crate) fn counted(n: usize, noun: &str) -> String {
    agreeing(n, noun, &format!("{noun}s"))
}

/// `1 row has`, `3 rows have`.
pub(crate) fn agreeing(n: usize, one: &str, more: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { more })
}

/// Number, from 1, of the line of a text in which a byte stands.
pub(crate) fn line_of(text: &str, at: usize) -> usize {
    1 + text.bytes().take(at).filter(|b| *b == b'\n').count()
}

/// What can go wrong before a computation starts: unreadable, malformed or contradictory input.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// the file
        path: PathBuf,
        /// what the operating system said
        source: std::io::Error,
    },
    /// A file was read, but its contents are not what they must be.
    #[error("{}{}: {message}", file.display(), if place.is_empty() { String::new() } else { format!(": {place}") })]
    File {
        /// the file
        file: PathBuf,
        /// line, joint or link; empty where it is the whole file
        place: String,
        /// what is wrong and what to do
        message: String,
    },
    /// An argument or setting is unusable.
    #[error("{0}")]
    Argument(String),
    /// The request is well-formed but cannot be met.
    #[error("{0}")]
    Infeasible(String),
    /// An output exists and may not be replaced.
    #[error("{} exists already; pass --force to replace it, or choose another --output", .0.display())]
    Exists(PathBuf),
}

/// Result of the library.
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    /// An I/O error with the file it happened on.
    pub fn io(path: impl AsRef<Path>, source: std::io::Error) -> Self {
        Error::Io {
            path: path.as_ref().to_path_buf(),
            source,
        }
    }

    /// An error in the contents of a file.
    pub fn file(
        file: impl AsRef<Path>,
        place: impl Into<String>,
        message: impl Into<String>,
    ) -> Self {
        Error::File {
            file: file.as_ref().to_path_buf(),
            place: place.into(),
            message: message.into(),
        }
    }

    /// The same error once more, for what failed once and is asked for again.
    pub(crate) fn again(&self) -> Self {
        match self {
            Error::Io { path, source } => Error::file(path, "", source.to_string()),
            Error::File {
                file,
                place,
                message,
            } => Error::file(file, place, message),
            Error::Argument(message) => Error::Argument(message.clone()),
            Error::Infeasible(message) => Error::Infeasible(message.clone()),
            Error::Exists(path) => Error::Exists(path.clone()),
        }
    }

    /// Whether this is a mistake in the arguments (exit status 2) rather than something that
    /// could not be done (exit status 1).
    pub fn is_argument(&self) -> bool {
        matches!(self, Error::Argument(_))
    }
}

/// A computed number as messages show it: six significant digits without zeros at the end, with an
/// exponent from a million up and below 0.001.
pub(crate) fn number(x: f64) -> String {
    // the shortest text of the rounded number has no more than its digits
    let x: f64 = format!("{x:.5e}").parse().unwrap_or(x);
    match x == 0.0 || !x.is_finite() || (1e-3..1e6).contains(&x.abs()) {
        true => format!("{x}"),
        false => format!("{x:e}"),
    }
}

/// Declares [`WarningKind`] with the code of each kind beside it.
macro_rules! warning_kinds {
    ($($(#[$doc:meta])+ $name:ident = $code:literal,)+) => {
        /// What kind of imperfection a [`Warning`] is about, for programs that filter warnings.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
        #[non_exhaustive]
        pub enum WarningKind {
            $($(#[$doc])+ #[serde(rename = $code)] $name,)+
        }

        impl WarningKind {
            /// All kinds, in the order of the pipeline.
            pub const ALL: &'static [WarningKind] = &[$(WarningKind::$name),+];

            /// The code in the JSON of the reports.
            pub fn code(self) -> &'static str {
                match self {
                    $(WarningKind::$name => $code,)+
                }
            }
        }
    };
}

warning_kinds! {
    /// A limit is not stated; it is taken as unlimited, or assumed for the design.
    LimitsMissing = "limits_missing",
    /// Two statements of a limit contradict each other; the message says which is used.
    LimitsContradict = "limits_contradict",
    /// A home pose or a locked joint lies outside its limits.
    OutsideLimits = "outside_limits",
    /// An entry of a robot file has no effect, or is given twice.
    EntryIgnored = "entry_ignored",
    /// A joint follows one that does not move it, and is held fixed.
    JointHeld = "joint_held",
    /// An angle is written with few digits; it counts as a right angle where identifiability is decided.
    AngleRounded = "angle_rounded",
    /// A friction or drive term is negative; it is kept as written.
    NegativeParameter = "negative_parameter",
    /// A link has no mass or no inertia; it is taken as zero or as a point mass.
    InertiaMissing = "inertia_missing",
    /// No rigid body has this mass and inertia.
    InertiaImpossible = "inertia_impossible",
    /// An inertia was changed to fit what the file says of it, such as identical legs.
    InertiaChanged = "inertia_changed",
    /// The geometry of a link cannot be read or was changed: its volume is unknown or scaled.
    GeometryUnread = "geometry_unread",
    /// Collisions are looked at in part or not at all; the message says what was left out.
    CollisionNotChecked = "collision_not_checked",
    /// Two links can hardly be moved apart; they keep a part of their distance instead of the margin.
    MarginReduced = "margin_reduced",
    /// A kinematic loop does not close exactly; it is closed as well as possible.
    LoopOpen = "loop_open",
    /// There are more actuators than freedoms; the forces of least norm are used.
    RedundantActuation = "redundant_actuation",
    /// The mechanism is singular at a pose.
    Singular = "singular",
    /// The torque noise is not stated; a share of the effort limit is taken.
    TorqueNoiseAssumed = "torque_noise_assumed",
    /// The border between identifiable and unidentifiable parameters is blurred.
    RankGap = "rank_gap",
    /// The motion excites some identifiable parameters hardly or not at all.
    NotExcited = "not_excited",
    /// Some parameters cannot be identified on this robot with any motion.
    NotIdentifiable = "not_identifiable",
    /// A limit between samples is bounded from differences, not proven.
    BoundedNotProven = "bounded_not_proven",
    /// The robot files are not those that the trajectory was designed with.
    RobotChanged = "robot_changed",
    /// Columns of a log are unknown or were not used.
    ColumnsIgnored = "columns_ignored",
    /// Rows of a log were left out: no, repeated or impossible time stamps, or a line that breaks off.
    RowsLeftOut = "rows_left_out",
    /// A log is so long that it was read in parts; the message says what comes from all of it, and what does not.
    ReadInParts = "read_in_parts",
    /// Samples of a channel are missing, stuck or saturated and were left out of the fit.
    SamplesLeftOut = "samples_left_out",
    /// Few samples of a log are sound in all channels.
    FewSoundSamples = "few_sound_samples",
    /// Time stamps were moved: the time jumps back, or its clock is too coarse.
    TimeRepaired = "time_repaired",
    /// The time has gaps; they are interpolated for filters and left out of the fit.
    TimeGaps = "time_gaps",
    /// Time stamps jitter; the log was resampled to an even grid.
    Resampled = "resampled",
    /// An angle jumps by a whole turn at the ends of its range, or lies beyond its limits by one: it was made continuous, or taken
    /// in the turn of the limits.
    TurnsCounted = "turns_counted",
    /// Numbers look as if they had another unit, sign or side of the gear.
    UnitSuspect = "unit_suspect",
    /// What a log is stated to be does not fit the robot.
    LogSuspect = "log_suspect",
    /// Measured poses contradict the geometry of the robot file by more than their noise.
    PoseContradicts = "pose_contradicts",
    /// What a fit leaves looks like joints of the legs that are not where the robot file says.
    GeometrySuspect = "geometry_suspect",
    /// A joint does not move in a log.
    JointNotMoving = "joint_not_moving",
    /// The stated period does not hold, or is too short or too long for the record.
    NotPeriodic = "not_periodic",
    /// The first period differs from the others and was left out of the mean.
    TransientLeftOut = "transient_left_out",
    /// A whole record was left out.
    RecordLeftOut = "record_left_out",
    /// Equations of joints at rest were left out of the fit.
    StandstillLeftOut = "standstill_left_out",
    /// What a model leaves of one joint goes with another joint; the joints seem to be coupled.
    JointsCoupled = "joints_coupled",
    /// The identified model predicts worse than the nominal one.
    WorseThanNominal = "worse_than_nominal",
    /// An identified parameter is not what such a robot has.
    ParameterImplausible = "parameter_implausible",
    /// What a model leaves goes with a column that it lacks; the column is proposed.
    ColumnProposed = "column_proposed",
    /// The robot file lists no joint terms; friction and offset are identified.
    JointTermsAssumed = "joint_terms_assumed",
    /// No record of the empty robot is there; its nominal model was subtracted.
    NominalModelAssumed = "nominal_model_assumed",
    /// Measured torques were divided by a gain that a known load showed.
    DriveGainApplied = "drive_gain_applied",
    /// No known load tells the drive gains; the load is as good as they are.
    DriveGainAssumed = "drive_gain_assumed",
    /// Two methods give a load whose intervals do not meet.
    MethodsDisagree = "methods_disagree",
    /// An effort limit cut a simulated torque.
    TorqueSaturated = "torque_saturated",
    /// Simulated friction did not settle within a step.
    FrictionChattered = "friction_chattered",
    /// A result file could not be written; the values stand in another one.
    FileNotWritten = "file_not_written",
    /// A motion starts or ends while a joint moves; a controller cannot play it from rest.
    MovingEnds = "moving_ends",
    /// Between two points a controller may leave the motion by more than is aimed at.
    RateCoarse = "rate_coarse",
    /// Joints of a motion are not in the file for the controller.
    JointsLeftOut = "joints_left_out",
}

/// Something imperfect that did not stop the work: it is printed and carried to the report.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Warning {
    /// what kind of imperfection it is
    pub kind: WarningKind,
    /// what it is about: a link, a joint, a file, a channel
    pub subject: String,
    /// what was found and what was assumed instead
    pub message: String,
}

impl Warning {
    /// A warning of a kind about `subject`.
    pub fn new(kind: WarningKind, subject: impl Into<String>, message: impl Into<String>) -> Self {
        Warning {
            kind,
            subject: subject.into(),
            message: message.into(),
        }
    }
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.subject, self.message)
    }
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn numbers_of_messages_have_no_dust() {
        for (x, text) in [
            (3.0 * 0.7, "2.1"),
            (0.1 + 0.2, "0.3"),
            (-2.0, "-2"),
            (0.0, "0"),
            (1234567.0, "1.23457e6"),
            (1.0 / 3e5, "3.33333e-6"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(number(x), text);
        }
    }
}
