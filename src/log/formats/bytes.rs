//! Numbers out of bytes; what lies beyond the end is `None`.

/// A place in bytes.
pub(super) struct Bytes<'a> {
    data: &'a [u8],
    at: usize,
    little: bool,
}

impl<'a> Bytes<'a> {
    /// From the first byte on.
    pub fn new(data: &'a [u8], little: bool) -> Self {
        Bytes {
            data,
            at: 0,
            little,
        }
    }

    pub fn position(&self) -> usize {
        self.at
    }

    pub fn rest(&self) -> &'a [u8] {
        self.data.get(self.at..).unwrap_or_default()
    }

    pub fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let end = self.at.checked_add(n)?;
        let out = self.data.get(self.at..end)?;
        self.at = end;
        Some(out)
    }

    pub fn skip(&mut self, n: usize) -> Option<()> {
        self.take(n).map(|_| ())
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let mut out: [u8; N] = self.take(N)?.try_into().ok()?;
        if !self.little {
            out.reverse();
        }
        Some(out)
    }

    pub fn u16(&mut self) -> Option<u16> {
        Some(u16::from_le_bytes(self.array()?))
    }

    pub fn u32(&mut self) -> Option<u32> {
        Some(u32::from_le_bytes(self.array()?))
    }

    pub fn u64(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.array()?))
    }

    pub fn f64(&mut self) -> Option<f64> {
        Some(f64::from_le_bytes(self.array()?))
    }

    /// A text behind its length in four bytes.
    pub fn text(&mut self) -> Option<String> {
        let n = self.u32()? as usize;
        Some(String::from_utf8_lossy(self.take(n)?).into_owned())
    }
}

/// Kind of the numbers of an array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    F32,
    F64,
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
}

impl Kind {
    /// Bytes of a number.
    pub fn size(self) -> usize {
        match self {
            Kind::I8 | Kind::U8 => 1,
            Kind::I16 | Kind::U16 => 2,
            Kind::F32 | Kind::I32 | Kind::U32 => 4,
            Kind::F64 | Kind::I64 | Kind::U64 => 8,
        }
    }

    /// All numbers in `data`.
    pub fn numbers(self, data: &[u8], little: bool) -> Vec<f64> {
        let size = self.size();
        data.chunks_exact(size)
            .map(|chunk| {
                let mut b = [0u8; 8];
                b[..size].copy_from_slice(chunk);
                if !little {
                    b[..size].reverse();
                }
                let low = u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
                let short = low as u16;
                match self {
                    Kind::F64 => f64::from_le_bytes(b),
                    Kind::F32 => f64::from(f32::from_bits(low)),
                    Kind::I8 => f64::from(b[0] as i8),
                    Kind::U8 => f64::from(b[0]),
                    Kind::I16 => f64::from(short as i16),
                    Kind::U16 => f64::from(short),
                    Kind::I32 => f64::from(low as i32),
                    Kind::U32 => f64::from(low),
                    Kind::I64 => i64::from_le_bytes(b) as f64,
                    Kind::U64 => u64::from_le_bytes(b) as f64,
                }
            })
            .collect()
    }
}
