//! Malformed XML, in words and with its line.

use roxmltree::Error as Xml;

/// Where in `text` and what is wrong. A file that breaks off is wrong where it ends.
pub(crate) fn malformed(text: &str, error: &Xml) -> (String, String) {
    let last = text.trim_end().lines().count().max(1);
    let (row, said) = match error {
        Xml::UnexpectedEndOfStream | Xml::UnclosedRootNode => {
            (last, "the file breaks off here".to_string())
        }
        Xml::NoRootNode => (last, "there is no element up to here".to_string()),
        _ => {
            let said = error.to_string();
            let said = said.split(" at ").next().unwrap_or_default().to_string();
            (error.pos().row as usize, said)
        }
    };
    (format!("line {row}"), format!("malformed XML: {said}"))
}
