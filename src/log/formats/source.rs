//! Files of text as UTF-8, also those that are packed (gzip, zstd) or written in UTF-16.

use miniz_oxide::inflate::stream::{InflateState, inflate};
use miniz_oxide::{DataFormat, MZFlush, MZStatus};
use std::fs::File;
use std::io::{self, BufRead, BufReader, Chain, Cursor, Read};
use std::path::Path;

/// First bytes of what is packed.
const GZIP: &[u8] = &[0x1f, 0x8b];
const ZSTD: &[u8] = &[0x28, 0xb5, 0x2f, 0xfd];
/// Packings within each other that are opened.
const DEPTH: usize = 2;
/// Bytes that are read at a time.
const BLOCK: usize = 64 << 10;

/// A file, and what it was packed in.
pub(super) struct Source {
    pub read: Box<dyn Read>,
    /// whether its bytes are not those of the file
    pub packed: bool,
}

/// Bytes that were looked at, and the others.
type Looked<R> = Chain<Cursor<Vec<u8>>, R>;

/// Opens a file.
pub(super) fn open(path: &Path) -> io::Result<Source> {
    let mut source = Source {
        read: Box::new(File::open(path)?),
        packed: false,
    };
    for _ in 0..DEPTH {
        let (head, read) = look(source.read)?;
        source.read = if head.starts_with(GZIP) {
            Box::new(Gzip::new(read))
        } else if head == ZSTD {
            Box::new(Zstd::new(read)?)
        } else if head.starts_with(b"\xff\xfe") || head.starts_with(b"\xfe\xff") {
            Box::new(Utf16::new(read, head[0] == 0xff))
        } else {
            return Ok(Source {
                read: Box::new(read),
                ..source
            });
        };
        source.packed = true;
    }
    Ok(source)
}

/// The first four bytes, and all of them.
fn look<R: Read>(mut read: R) -> io::Result<(Vec<u8>, Looked<R>)> {
    let mut head = vec![0; 4];
    let count = fill(&mut read, &mut head)?;
    head.truncate(count);
    Ok((head.clone(), Cursor::new(head).chain(read)))
}

/// As many bytes as there are.
pub(super) fn fill(read: &mut impl Read, to: &mut [u8]) -> io::Result<usize> {
    let mut filled = 0;
    while filled < to.len() {
        match read.read(&mut to[filled..]) {
            Ok(0) => break,
            Ok(n) => filled += n,
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
    Ok(filled)
}

fn damaged(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what.to_string())
}

/// Members of gzip one after another (RFC 1952).
struct Gzip<R> {
    inner: R,
    state: Box<InflateState>,
    input: Vec<u8>,
    /// the part of the input that was not used yet
    at: usize,
    /// whether a member was begun and not ended
    within: bool,
}

impl<R: Read> Gzip<R> {
    fn new(inner: R) -> Self {
        Gzip {
            inner,
            state: InflateState::new_boxed(DataFormat::Raw),
            input: Vec::new(),
            at: 0,
            within: false,
        }
    }

    /// Reads more; whether there was more.
    fn more(&mut self) -> io::Result<bool> {
        self.input.drain(..self.at);
        self.at = 0;
        let from = self.input.len();
        self.input.resize(from + BLOCK, 0);
        let count = fill(&mut self.inner, &mut self.input[from..])?;
        self.input.truncate(from + count);
        Ok(count > 0)
    }

    fn byte(&mut self) -> io::Result<u8> {
        if self.at == self.input.len() && !self.more()? {
            return Err(damaged("the packed file is cut off"));
        }
        self.at += 1;
        Ok(self.input[self.at - 1])
    }

    fn skip(&mut self, count: usize) -> io::Result<()> {
        (0..count).try_for_each(|_| self.byte().map(drop))
    }

    /// The header of the next member; whether there is one.
    fn header(&mut self) -> io::Result<bool> {
        if self.at == self.input.len() && !self.more()? {
            return Ok(false);
        }
        let start = [self.byte()?, self.byte()?, self.byte()?];
        if start[..2] != *GZIP || start[2] != 8 {
            return Err(damaged("what follows the packed data is no gzip"));
        }
        let flags = self.byte()?;
        self.skip(6)?;
        if flags & 4 != 0 {
            let count = u16::from_le_bytes([self.byte()?, self.byte()?]);
            self.skip(count.into())?;
        }
        // a name, a comment
        for flag in [8, 16] {
            while flags & flag != 0 && self.byte()? != 0 {}
        }
        if flags & 2 != 0 {
            self.skip(2)?;
        }
        self.state.reset(DataFormat::Raw);
        self.within = true;
        Ok(true)
    }
}

impl<R: Read> Read for Gzip<R> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        loop {
            if !self.within && !self.header()? {
                return Ok(0);
            }
            if self.at == self.input.len() && !self.more()? {
                return Err(damaged("the packed file is cut off"));
            }
            let input = &self.input[self.at..];
            let step = inflate(&mut self.state, input, to, MZFlush::None);
            self.at += step.bytes_consumed;
            match step.status {
                Ok(MZStatus::StreamEnd) => {
                    // a checksum and the length
                    self.skip(8)?;
                    self.within = false;
                }
                Ok(_) => {}
                Err(miniz_oxide::MZError::Buf) if step.bytes_consumed > 0 => {}
                Err(_) => return Err(damaged("the packed data are damaged")),
            }
            if step.bytes_written > 0 || to.is_empty() {
                return Ok(step.bytes_written);
            }
        }
    }
}

/// Frames of zstd one after another.
struct Zstd {
    /// `None` at the end and after an error
    frame: Option<Frame>,
}

type Frame = ruzstd::decoding::StreamingDecoder<
    BufReader<Looked<Box<dyn Read>>>,
    ruzstd::decoding::FrameDecoder,
>;

impl Zstd {
    fn new(read: Looked<Box<dyn Read>>) -> io::Result<Self> {
        let frame = frame(BufReader::with_capacity(BLOCK, read)).map(Some)?;
        Ok(Zstd { frame })
    }
}

fn frame(read: BufReader<Looked<Box<dyn Read>>>) -> io::Result<Frame> {
    let broken = |e| damaged(&format!("the packed data are damaged ({e})"));
    Frame::new(read).map_err(broken)
}

impl Read for Zstd {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        while let Some(mut now) = self.frame.take() {
            let count = now.read(to)?;
            if count > 0 || to.is_empty() {
                self.frame = Some(now);
                return Ok(count);
            }
            let mut rest = now.into_inner();
            if !rest.fill_buf()?.is_empty() {
                self.frame = Some(frame(rest)?);
            }
        }
        Ok(0)
    }
}

/// Text in UTF-16 as UTF-8; what is no text becomes the character that stands for it.
struct Utf16<R> {
    inner: R,
    little: bool,
    /// what does not fit into what was asked for
    out: Vec<u8>,
    at: usize,
    /// the first half of a pair at the end of a block
    half: Option<u16>,
}

impl<R: Read> Utf16<R> {
    fn new(inner: R, little: bool) -> Self {
        Utf16 {
            inner,
            little,
            out: Vec::new(),
            at: 0,
            half: None,
        }
    }
}

impl<R: Read> Read for Utf16<R> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        const MARK: char = '\u{feff}';
        while self.at == self.out.len() {
            let mut bytes = [0; BLOCK];
            let count = fill(&mut self.inner, &mut bytes)?;
            if count == 0 && self.half.is_none() {
                return Ok(0);
            }
            let pairs = bytes[..count].chunks_exact(2).map(|b| match self.little {
                true => u16::from_le_bytes([b[0], b[1]]),
                false => u16::from_be_bytes([b[0], b[1]]),
            });
            let mut units: Vec<u16> = self.half.take().into_iter().chain(pairs).collect();
            if count > 0 {
                self.half = units.pop_if(|u| (0xd800..0xdc00).contains(u));
            }
            let text = char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER));
            self.out = text.filter(|c| *c != MARK).collect::<String>().into_bytes();
            self.at = 0;
        }
        let count = to.len().min(self.out.len() - self.at);
        to[..count].copy_from_slice(&self.out[self.at..self.at + count]);
        self.at += count;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unpacked(data: &[u8]) -> io::Result<(String, bool)> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("file");
        std::fs::write(&path, data)?;
        let mut source = open(&path)?;
        let mut text = String::new();
        source.read.read_to_string(&mut text)?;
        Ok((text, source.packed))
    }

    /// A member of gzip, with the name of a file in its header.
    fn member(data: &[u8]) -> Vec<u8> {
        let mut out = vec![0x1f, 0x8b, 8, 8, 0, 0, 0, 0, 0, 3];
        out.extend(b"log.csv\0");
        out.extend(miniz_oxide::deflate::compress_to_vec(data, 6));
        out.extend([0; 8]);
        out
    }

    fn table(rows: usize) -> String {
        let row = |i: usize| format!("{i},{},{}\n", (i * i) % 977, (i * 7919) % 104_729);
        (0..rows).map(row).collect()
    }

    #[test]
    fn packed_files_are_read_whole() {
        let text = table(40_000);
        let plain = unpacked(text.as_bytes()).unwrap();
        assert_eq!(plain, (text.clone(), false));
        let (a, b) = text.as_bytes().split_at(123_456);
        let mut both = member(a);
        both.extend(member(b));
        assert_eq!(unpacked(&both).unwrap(), (text.clone(), true));
        // cut anywhere, or damaged, it is an error and no shorter table
        for end in [11, 5_000, both.len() - 3] {
            assert!(unpacked(&both[..end]).is_err(), "{end}");
        }
        let mut damaged = both.clone();
        damaged[2_000..2_040].fill(0xa5);
        let got = unpacked(&damaged);
        assert!(got.is_err() || got.unwrap().0 != text);
        let level = ruzstd::encoding::CompressionLevel::Fastest;
        let mut frames = ruzstd::encoding::compress_to_vec(a, level);
        frames.extend(ruzstd::encoding::compress_to_vec(b, level));
        assert_eq!(unpacked(&frames).unwrap(), (text, true));
        assert!(unpacked(&frames[..frames.len() - 9]).is_err());
        // however many there are
        let one = ruzstd::encoding::compress_to_vec(&b"1,2\n"[..], level);
        let many = unpacked(&one.repeat(20_000)).unwrap();
        assert_eq!(many, ("1,2\n".repeat(20_000), true));
    }

    #[test]
    fn text_of_two_bytes_a_character_is_read() {
        let text = format!("Gelenk 1 [°],q\n{}{}", "𝛕;".repeat(50_000), table(1000));
        for little in [true, false] {
            let pair = |u: u16| {
                if little {
                    u.to_le_bytes()
                } else {
                    u.to_be_bytes()
                }
            };
            let units = std::iter::once(0xfeff).chain(text.encode_utf16());
            let data: Vec<u8> = units.flat_map(pair).collect();
            assert_eq!(unpacked(&data).unwrap(), (text.clone(), true));
        }
    }
}
