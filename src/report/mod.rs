//! Reports: one self-contained HTML file for people, one JSON document for machines.
//!
//! Every report is a list of `html::Section`s in the frame of `html::page`, with figures from
//! `plot`. Nothing in a report depends on the time or the machine, so the same input gives the
//! same bytes; nothing is fetched from anywhere, so a report can be stored and sent as it is.

#[doc(hidden)]
pub mod format;
pub(crate) mod html;
pub(crate) mod joints;
pub(crate) mod plot;
pub(crate) mod view;
