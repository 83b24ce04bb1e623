//! `trajectory_msgs/msg/JointTrajectory` in CDR, the encoding of ROS 2 messages: little endian, each number at a
//! multiple of its size, counted from behind the four bytes that say so.

/// A message being put together.
pub(super) struct Cdr(Vec<u8>);

impl Cdr {
    pub(super) fn new() -> Self {
        // plain CDR, little endian
        Cdr(vec![0, 1, 0, 0])
    }

    pub(super) fn bytes(self) -> Vec<u8> {
        self.0
    }

    fn align(&mut self, size: usize) {
        while !(self.0.len() - 4).is_multiple_of(size) {
            self.0.push(0);
        }
    }

    pub(super) fn u32(&mut self, value: u32) {
        self.align(4);
        self.0.extend(value.to_le_bytes());
    }

    /// A text: its length with the zero at its end, then its bytes.
    pub(super) fn string(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }

    /// A sequence of numbers; one without any is its length alone.
    pub(super) fn doubles(&mut self, values: &[f64]) {
        self.u32(values.len() as u32);
        if !values.is_empty() {
            self.align(8);
        }
        for value in values {
            self.0.extend(value.to_le_bytes());
        }
    }

    /// Seconds and nanoseconds.
    pub(super) fn time(&mut self, seconds: f64) {
        let (whole, nano) = split(seconds);
        self.u32(whole);
        self.u32(nano);
    }
}

/// A time as whole seconds and nanoseconds, to the nearest one.
pub(super) fn split(seconds: f64) -> (u32, u32) {
    let whole = seconds.floor();
    let nano = ((seconds - whole) * 1e9).round();
    match nano >= 1e9 {
        true => (whole as u32 + 1, 0),
        false => (whole as u32, nano as u32),
    }
}

/// The definition of the message and of those in it, as MCAP files carry it.
pub(super) const SCHEMA: &str = "\
std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint[] points
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: trajectory_msgs/JointTrajectoryPoint
float64[] positions
float64[] velocities
float64[] accelerations
float64[] effort
builtin_interfaces/Duration time_from_start
================================================================================
MSG: builtin_interfaces/Duration
int32 sec
uint32 nanosec
";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_at_multiples_of_their_size() {
        let mut cdr = Cdr::new();
        cdr.string("ab");
        cdr.doubles(&[1.0]);
        cdr.doubles(&[]);
        cdr.time(1.9999999999);
        let bytes = cdr.bytes();
        // 4 head, 4 + 3 text, 1 fill, 4 length, 4 fill, 8 number, 4 length, 8 time
        assert_eq!(bytes.len(), 4 + 7 + 1 + 4 + 4 + 8 + 4 + 8);
        assert_eq!(&bytes[4..11], &[3, 0, 0, 0, b'a', b'b', 0]);
        assert_eq!(&bytes[20..28], &1.0f64.to_le_bytes());
        assert_eq!(&bytes[32..40], &[2, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(split(2.5), (2, 500_000_000));
    }
}
