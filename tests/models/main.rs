//! Models from records: identification, loads, and an H4 from end to end.

#[path = "../common/mod.rs"]
mod common;

mod condense;
mod h4_identification;
mod identify;
mod load;
mod wrong_logs;
