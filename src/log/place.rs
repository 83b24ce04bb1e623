//! A column by its name, or by its number from 1.

/// Where a quantity stands in a table.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Place {
    Name(String),
    Number(usize),
}

impl Place {
    /// Which of the columns with these names it is.
    pub fn position<'a>(&self, mut names: impl Iterator<Item = &'a str>) -> Option<usize> {
        match self {
            Place::Name(name) => names.position(|n| n == name),
            Place::Number(k) => k.checked_sub(1).filter(|k| *k < names.count()),
        }
    }
}
