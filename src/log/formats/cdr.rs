//! CDR, the encoding of ROS 2 messages: numbers stand at multiples of their size, counted from behind
//! the four bytes that say how it is encoded.

use super::bytes::Bytes;

/// A message that is being read.
pub(super) struct Cdr<'a> {
    bytes: Bytes<'a>,
    /// widest alignment: 4 in version 2 of the encoding
    widest: usize,
}

impl<'a> Cdr<'a> {
    pub fn new(data: &'a [u8]) -> Option<Self> {
        let (head, body) = data.split_at_checked(4)?;
        let kind = head[1];
        Some(Cdr {
            bytes: Bytes::new(body, kind & 1 == 1),
            widest: if kind >= 6 { 4 } else { 8 },
        })
    }

    fn align(&mut self, size: usize) -> Option<()> {
        let size = size.min(self.widest);
        self.bytes
            .skip((size - self.bytes.position() % size) % size)
    }

    pub fn u32(&mut self) -> Option<u32> {
        self.align(4)?;
        self.bytes.u32()
    }

    /// Bytes of a text without the zero at its end.
    pub fn text(&mut self) -> Option<&'a [u8]> {
        let n = self.u32()? as usize;
        let bytes = self.bytes.take(n)?;
        Some(bytes.strip_suffix(&[0]).unwrap_or(bytes))
    }

    /// Appends a sequence of numbers and returns their count.
    pub fn doubles(&mut self, into: &mut Vec<f64>) -> Option<usize> {
        let n = self.u32()? as usize;
        if n == 0 {
            return Some(0);
        }
        self.align(8)?;
        if n > self.bytes.rest().len() / 8 {
            return None;
        }
        for _ in 0..n {
            into.push(self.bytes.f64()?);
        }
        Some(n)
    }

    /// A stamp in seconds and nanoseconds.
    pub fn time(&mut self) -> Option<(i32, u32)> {
        Some((self.u32()? as i32, self.u32()?))
    }

    /// The stamp of a header.
    pub fn header(&mut self) -> Option<(i32, u32)> {
        let stamp = self.time()?;
        self.text()?;
        Some(stamp)
    }
}
