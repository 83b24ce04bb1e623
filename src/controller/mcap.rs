//! The MCAP container (<https://mcap.dev/spec>) with one message in one chunk that is not compressed, and with the
//! indexes by which players of ROS 2 find it.

use super::zip::crc32;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// One message and what is said of it.
pub(super) struct Message<'a> {
    /// where it is published
    pub topic: &'a str,
    /// type of the message
    pub schema: &'a str,
    /// definition of the type
    pub definition: &'a str,
    /// the message, encoded
    pub data: &'a [u8],
}

/// Fields of a record, little endian; texts and lists with their lengths.
#[derive(Default)]
struct Record(Vec<u8>);

impl Record {
    fn u16(mut self, value: u16) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }
    fn u32(mut self, value: u32) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }
    fn u64(mut self, value: u64) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }
    fn text(self, text: &str) -> Self {
        self.block(text.as_bytes())
    }
    fn block(self, bytes: &[u8]) -> Self {
        let mut out = self.u32(bytes.len() as u32);
        out.0.extend(bytes);
        out
    }
    /// Bytes without a length before them.
    fn bytes(mut self, bytes: &[u8]) -> Self {
        self.0.extend(bytes);
        self
    }
    /// The record behind its code and its length.
    fn put(self, code: u8, out: &mut Vec<u8>) {
        out.push(code);
        out.extend((self.0.len() as u64).to_le_bytes());
        out.extend(self.0);
    }
}

/// The file of one message at time zero.
pub(super) fn file(message: &Message) -> Vec<u8> {
    let (id, channel) = (1u16, 0u16);
    let schema = || {
        Record::default()
            .u16(id)
            .text(message.schema)
            .text("ros2msg")
            .text(message.definition)
    };
    let quality = Record::default().text("offered_qos_profiles").text("");
    let topic = || {
        Record::default()
            .u16(channel)
            .u16(id)
            .text(message.topic)
            .text("cdr")
            .block(&quality.0)
    };
    // the chunk: schema, channel, message
    let mut chunk = Vec::new();
    schema().put(0x03, &mut chunk);
    topic().put(0x04, &mut chunk);
    let at = chunk.len() as u64;
    Record::default()
        .u16(channel)
        .u32(0)
        .u64(0)
        .u64(0)
        .bytes(message.data)
        .put(0x05, &mut chunk);

    let mut out = MAGIC.to_vec();
    Record::default()
        .text("ros2")
        .text(concat!("excite ", env!("CARGO_PKG_VERSION")))
        .put(0x01, &mut out);
    let chunk_start = out.len() as u64;
    Record::default()
        .u64(0)
        .u64(0)
        .u64(chunk.len() as u64)
        .u32(crc32(&chunk))
        .text("")
        .u64(chunk.len() as u64)
        .bytes(&chunk)
        .put(0x06, &mut out);
    let index_start = out.len() as u64;
    let entry = Record::default().u64(0).u64(at);
    Record::default()
        .u16(channel)
        .block(&entry.0)
        .put(0x07, &mut out);
    let index_length = out.len() as u64 - index_start;
    Record::default().u32(0).put(0x0f, &mut out);

    // the summary
    let mut groups: Vec<(u8, u64, u64)> = Vec::new();
    let mut group = |code: u8, record: Record, out: &mut Vec<u8>| {
        let start = out.len() as u64;
        record.put(code, out);
        groups.push((code, start, out.len() as u64 - start));
    };
    let summary_start = out.len() as u64;
    group(0x03, schema(), &mut out);
    group(0x04, topic(), &mut out);
    let offsets = Record::default().u16(channel).u64(index_start);
    let chunk_index = Record::default()
        .u64(0)
        .u64(0)
        .u64(chunk_start)
        .u64(index_start - chunk_start)
        .block(&offsets.0)
        .u64(index_length)
        .text("")
        .u64(chunk.len() as u64)
        .u64(chunk.len() as u64);
    group(0x08, chunk_index, &mut out);
    let counts = Record::default().u16(channel).u64(1);
    // one message, schema, channel; no attachment, no metadata; one chunk; first and last time
    let statistics = Record::default()
        .u64(1)
        .u16(1)
        .u32(1)
        .u32(0)
        .u32(0)
        .u32(1)
        .u64(0)
        .u64(0)
        .block(&counts.0);
    group(0x0b, statistics, &mut out);
    let offset_start = out.len() as u64;
    for (code, start, length) in groups {
        Record(vec![code])
            .u64(start)
            .u64(length)
            .put(0x0e, &mut out);
    }
    // the footer, whose checksum covers the summary and its own first fields
    let mut tail = out[summary_start as usize..].to_vec();
    tail.push(0x02);
    tail.extend(20u64.to_le_bytes());
    let footer = Record::default().u64(summary_start).u64(offset_start);
    tail.extend(&footer.0);
    footer.u32(crc32(&tail)).put(0x02, &mut out);
    out.extend(MAGIC);
    out
}
