//! MCAP (<https://mcap.dev/spec>), read from its start to its end: chunks without compression, with
//! zstd or with lz4. The indexes are not needed.

use super::bag::Collector;
use super::bytes::Bytes;
use crate::error::{Error, Result, Warning, WarningKind};
use std::collections::HashMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

/// Largest chunk after unpacking, bytes.
const LARGEST: u64 = 2 << 30;

/// Codes of records.
const FOOTER: u8 = 0x02;
const SCHEMA: u8 = 0x03;
const CHANNEL: u8 = 0x04;
const MESSAGE: u8 = 0x05;
const CHUNK: u8 = 0x06;
const DATA_END: u8 = 0x0f;

/// Schemas and channels met so far.
#[derive(Default)]
struct Known {
    schemas: HashMap<u16, String>,
    topics: HashMap<u16, usize>,
}

pub(super) fn read(path: &Path, bag: &mut Collector) -> Result<()> {
    let file = File::open(path).map_err(|e| Error::io(path, e))?;
    let size = file.metadata().map_err(|e| Error::io(path, e))?.len();
    let mut file = BufReader::with_capacity(1 << 20, file);
    let mut magic = [0u8; 8];
    file.read_exact(&mut magic)
        .map_err(|e| Error::io(path, e))?;
    let mut at = 8u64;
    let mut known = Known::default();
    let mut body = Vec::new();
    let broken = |at: u64| {
        let message = "the record is damaged";
        Error::file(path, format!("byte {at}"), message)
    };
    loop {
        let mut head = [0u8; 9];
        if file.read_exact(&mut head).is_err() {
            cut_off(path, bag, at);
            return Ok(());
        }
        let [code, rest @ ..] = head;
        let length = u64::from_le_bytes(rest);
        if length > size.saturating_sub(at) {
            cut_off(path, bag, at);
            return Ok(());
        }
        body.resize(length as usize, 0);
        file.read_exact(&mut body).map_err(|e| Error::io(path, e))?;
        match code {
            FOOTER | DATA_END => return Ok(()),
            CHUNK => {
                let mut b = Bytes::new(&body, true);
                let head = (|| {
                    b.skip(16)?;
                    let full = b.u64()?;
                    b.skip(4)?;
                    let compression = b.text()?;
                    let packed = b.u64()?;
                    Some((full, compression, b.take(usize::try_from(packed).ok()?)?))
                })();
                let (full, compression, packed) = head.ok_or_else(|| broken(at))?;
                let unpacked = unpack(&compression, packed, full)
                    .map_err(|m| Error::file(path, format!("chunk at byte {at}"), m))?;
                let data = unpacked.as_deref().unwrap_or(packed);
                let mut b = Bytes::new(data, true);
                while !b.rest().is_empty() {
                    let record = (|| {
                        let code = *b.take(1)?.first()?;
                        let length = usize::try_from(b.u64()?).ok()?;
                        Some((code, b.take(length)?))
                    })();
                    let (code, body) = record.ok_or_else(|| broken(at))?;
                    take(code, body, &mut known, bag).ok_or_else(|| broken(at))?;
                }
            }
            code => take(code, &body, &mut known, bag).ok_or_else(|| broken(at))?,
        }
        if bag.flush()?.is_break() {
            return Ok(());
        }
        at += 9 + length;
    }
}

fn cut_off(path: &Path, bag: &mut Collector, at: u64) {
    bag.warnings.push(Warning::new(
        WarningKind::RowsLeftOut,
        path.display().to_string(),
        format!("the file breaks off at byte {at}; what stands before it was read"),
    ));
}

/// A schema, channel or message; others are passed over.
fn take(code: u8, body: &[u8], known: &mut Known, bag: &mut Collector) -> Option<()> {
    let mut b = Bytes::new(body, true);
    match code {
        SCHEMA => {
            let id = b.u16()?;
            known.schemas.insert(id, b.text()?);
        }
        CHANNEL => {
            let (id, schema) = (b.u16()?, b.u16()?);
            let (topic, encoding) = (b.text()?, b.text()?);
            let kind = known.schemas.get(&schema).map_or("", String::as_str);
            known.topics.insert(id, bag.topic(&topic, kind, &encoding));
        }
        MESSAGE => {
            let channel = b.u16()?;
            b.skip(4)?;
            let stamp = b.u64()?;
            b.skip(8)?;
            if let Some(topic) = known.topics.get(&channel) {
                bag.message(*topic, stamp as i64, b.rest());
            }
        }
        _ => {}
    }
    Some(())
}

/// The records of a chunk; `None` where they are not compressed.
fn unpack(compression: &str, packed: &[u8], full: u64) -> Result<Option<Vec<u8>>, String> {
    if full > LARGEST {
        return Err(format!("it says that it holds {full} bytes"));
    }
    let mut out = Vec::new();
    let read = match compression {
        "" => return Ok(None),
        "zstd" => ruzstd::decoding::StreamingDecoder::new(packed)
            .map_err(|e| e.to_string())
            .and_then(|d| {
                d.take(full)
                    .read_to_end(&mut out)
                    .map_err(|e| e.to_string())
            }),
        "lz4" => lz4_flex::frame::FrameDecoder::new(packed)
            .take(full)
            .read_to_end(&mut out)
            .map_err(|e| e.to_string()),
        other => return Err(format!("compression `{other}` is not read")),
    };
    match read {
        Ok(n) if n as u64 == full => Ok(Some(out)),
        Ok(n) => Err(format!("it holds {n} bytes and says {full}")),
        Err(e) => Err(format!("its {compression} data are damaged ({e})")),
    }
}
