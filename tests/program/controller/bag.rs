//! The bag for ROS 2, read by its specification.

use super::{Folder, designed, motion, state};

/// The bag, read through its indexes as a player does: footer, chunk index, message index, message.
#[test]
fn a_message_in_a_bag() {
    let (folder, f) = (Folder::new(), motion("planar2"));
    folder.export(
        &designed("planar2"),
        "--format ros2-mcap --rate 50",
        "a.mcap",
    );
    let bytes = std::fs::read(folder.path("a.mcap")).unwrap();
    let u16_at = |at: usize| u16::from_le_bytes(bytes[at..at + 2].try_into().unwrap());
    let u32_at = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let u64_at = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize;
    let end = bytes.len();
    assert_eq!(&bytes[..8], &bytes[end - 8..]);
    let footer = end - 8 - 20;
    assert_eq!((bytes[footer - 9], u64_at(footer - 8)), (2, 20));
    // records of the summary
    let mut at = u64_at(footer);
    let mut index = None;
    while bytes[at] != 2 {
        if bytes[at] == 8 {
            index = Some(at + 9);
        }
        at += 9 + u64_at(at + 1);
    }
    let index = index.unwrap();
    let chunk = u64_at(index + 16);
    assert_eq!(bytes[chunk], 6);
    let map = index + 32;
    assert_eq!(u32_at(map), 10);
    let messages = u64_at(map + 6);
    assert_eq!(
        (bytes[messages], u16_at(messages + 9)),
        (7, u16_at(map + 4))
    );
    let offset = u64_at(messages + 9 + 2 + 4 + 8);
    // behind the head of the chunk: times, size, checksum, no compression, size
    let message = chunk + 9 + 8 + 8 + 8 + 4 + 4 + 8 + offset;
    assert_eq!(bytes[message], 5);
    let start = message + 9 + 2 + 4 + 8 + 8;
    let body = &bytes[start..message + 9 + u64_at(message + 1)];
    let mut cdr = Cdr { bytes: body, at: 4 };
    assert_eq!((cdr.u32(), cdr.u32(), cdr.text()), (0, 0, String::new()));
    let names: Vec<String> = (0..cdr.u32()).map(|_| cdr.text()).collect();
    assert_eq!(names, ["joint1", "joint2"]);
    assert_eq!(cdr.u32(), 501);
    for i in 0..501 {
        let [q, dq, ddq] = state(&f, f64::from(i) / 50.0);
        for expected in [q, dq, ddq, vec![]] {
            assert_eq!(cdr.doubles(), expected);
        }
        assert_eq!((cdr.u32(), cdr.u32()), (i / 50, i % 50 * 20_000_000));
    }
    assert_eq!(cdr.at, body.len());
}

/// A message in CDR, being read.
struct Cdr<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Cdr<'_> {
    fn skip(&mut self, size: usize) {
        self.at += (size - (self.at - 4) % size) % size;
    }

    fn u32(&mut self) -> u32 {
        self.skip(4);
        self.at += 4;
        u32::from_le_bytes(self.bytes[self.at - 4..self.at].try_into().unwrap())
    }

    fn text(&mut self) -> String {
        let n = self.u32() as usize;
        self.at += n;
        String::from_utf8(self.bytes[self.at - n..self.at - 1].to_vec()).unwrap()
    }

    fn doubles(&mut self) -> Vec<f64> {
        let n = self.u32() as usize;
        if n > 0 {
            self.skip(8);
        }
        let from = self.at;
        self.at += 8 * n;
        let values = self.bytes[from..self.at].chunks_exact(8);
        values
            .map(|b| f64::from_le_bytes(b.try_into().unwrap()))
            .collect()
    }
}
