//! Pairs that an SRDF file disables: `<disable_collisions link1="…" link2="…" reason="…"/>`.

use crate::error::{Error, Result};
use crate::robot::xml_error::malformed;
use std::path::Path;

/// Largest file that is read, bytes.
const LARGEST: u64 = 64 << 20;

/// The disabled pairs.
///
/// # Errors
/// A file that cannot be read or is no SRDF.
pub(super) fn disabled(path: &Path) -> Result<Vec<[String; 2]>> {
    let size = std::fs::metadata(path)
        .map_err(|e| Error::io(path, e))?
        .len();
    if size > LARGEST {
        return Err(Error::file(path, "", "larger than 64 MiB: this is no SRDF"));
    }
    let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
    let document = roxmltree::Document::parse(&text).map_err(|e| {
        let (place, said) = malformed(&text, &e);
        Error::file(path, place, said)
    })?;
    let root = document.root_element();
    if root.tag_name().name() != "robot" {
        let tag = root.tag_name().name();
        let message = format!("the root element of an SRDF is <robot>, not <{tag}>");
        return Err(Error::file(path, "", message));
    }
    let pairs = root
        .children()
        .filter(|n| n.is_element() && n.tag_name().name() == "disable_collisions");
    Ok(pairs
        .filter_map(|n| {
            let [a, b] = ["link1", "link2"].map(|k| n.attribute(k).map(str::to_string));
            Some([a?, b?])
        })
        .collect())
}
