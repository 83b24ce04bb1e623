//! ZIP archives without compression, which is what NumPy's `.npz` files are; and the checksum in them.

use crate::error::{Error, Result};

/// CRC-32 of ISO 3309, as ZIP and MCAP use it.
pub(super) fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = !0u32;
    for &byte in bytes {
        let mut rest = (crc ^ u32::from(byte)) & 0xff;
        for _ in 0..8 {
            rest = (rest >> 1) ^ (0xedb8_8320 & (rest & 1).wrapping_neg());
        }
        crc = (crc >> 8) ^ rest;
    }
    !crc
}

/// An archive of files with their names.
///
/// # Errors
/// [`Error::Infeasible`] if it would be larger than 4 GB, which the format cannot hold.
pub(super) fn zip(files: &[(&str, Vec<u8>)]) -> Result<Vec<u8>> {
    let mut out = Vec::new();
    let mut directory = Vec::new();
    let mut put = |name: &str, bytes: &[u8]| -> Option<()> {
        let (size, at) = (u32::try_from(bytes.len()).ok()?, out.len());
        let mut head = Vec::new();
        // version 2.0, no flags, stored; 1 January 1980
        for field in [20u16, 0, 0, 0, 0x21] {
            head.extend(field.to_le_bytes());
        }
        for field in [crc32(bytes), size, size] {
            head.extend(field.to_le_bytes());
        }
        head.extend((name.len() as u16).to_le_bytes());
        head.extend(0u16.to_le_bytes());
        out.extend(b"PK\x03\x04");
        out.extend(&head);
        out.extend(name.as_bytes());
        out.extend(bytes);
        directory.extend(b"PK\x01\x02");
        directory.extend(20u16.to_le_bytes());
        directory.extend(&head);
        // no comment, first disk, no attributes
        directory.extend([0u8; 10]);
        directory.extend(u32::try_from(at).ok()?.to_le_bytes());
        directory.extend(name.as_bytes());
        Some(())
    };
    let all = files.iter().try_for_each(|(name, bytes)| put(name, bytes));
    let sizes = (u32::try_from(directory.len()), u32::try_from(out.len()));
    let (Some(()), (Ok(size), Ok(at))) = (all, sizes) else {
        return Err(Error::Infeasible(
            "the file would be larger than 4 GB; lower --rate or --periods".into(),
        ));
    };
    out.extend(&directory);
    out.extend(b"PK\x05\x06\0\0\0\0");
    let count = (files.len() as u16).to_le_bytes();
    out.extend(count);
    out.extend(count);
    out.extend(size.to_le_bytes());
    out.extend(at.to_le_bytes());
    out.extend([0, 0]);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_the_known_one() {
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
        assert_eq!(crc32(b""), 0);
    }

    #[test]
    fn an_archive_has_its_three_parts() {
        let bytes = zip(&[("a", vec![1, 2, 3]), ("bc", vec![])]).unwrap();
        assert_eq!(&bytes[30..34], &[b'a', 1, 2, 3]);
        let end = &bytes[bytes.len() - 22..];
        assert_eq!((&end[..4], end[8]), (&b"PK\x05\x06"[..], 2));
        let at = u32::from_le_bytes([end[16], end[17], end[18], end[19]]) as usize;
        assert_eq!(&bytes[at..at + 4], b"PK\x01\x02");
        assert_eq!(bytes.len(), at + 2 * 46 + 3 + 22);
    }
}
