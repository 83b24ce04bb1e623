//! The report after the run: what the records say about the model.

mod errors;
mod parameters;
mod signals;
mod traces;
mod verdict;

pub use verdict::verdict;

use crate::identify::{Identification, Settings};
use crate::log::Purpose;
use crate::plant::Plant;
use crate::report::format::unit_of;
use crate::report::html::{self, Section, Tone};
use crate::report::joints;
use crate::robot::Motion;
use crate::trajectory::certificate::Kind;
use maud::html;

/// `report.html`.
pub fn html(plant: &Plant, id: &Identification, settings: &Settings) -> String {
    let (tone, text) = verdict(plant, id);
    let mut sections = vec![
        Section::new("", verdict::tiles(id)),
        errors::residuals(plant, id),
        errors::followers(plant, id),
        traces::torques(plant, id),
        traces::over_time(plant, id),
        traces::over_velocity(plant, id),
        traces::spectra(plant, id),
        parameters::base(id),
        parameters::standard(plant, id),
        parameters::essential(id),
        parameters::prior(id, settings),
        signals::section(id),
        joints::order(plant.actuators().iter().map(|j| j.name.as_str())),
    ];
    if let Some(scene) = &id.scene {
        let last = sections.len() - 1;
        sections.insert(
            last,
            Section::new("In your simulator", crate::export::scene_page(scene)),
        );
    }
    if !id.warnings.is_empty() {
        let list = html! { ul { @for w in &id.warnings { li { strong { (w.subject) } ": " (w.message) } } } };
        let mut s = Section::new("Warnings", list);
        s.tone = Tone::Fair;
        sections.insert(1, s);
    }
    let line = format!(
        "identified from {} and tested on {}",
        names(id, Purpose::Fit),
        match names(id, Purpose::Holdout).as_str() {
            "" => "nothing".to_string(),
            other => other.to_string(),
        }
    );
    html::page(
        &format!("Identification of {}", plant.name()),
        &line,
        (tone, &text),
        &sections,
    )
}

fn names(id: &Identification, purpose: Purpose) -> String {
    let list: Vec<&str> = id
        .prepared
        .iter()
        .filter(|p| p.purpose == purpose)
        .map(|p| p.name.as_str())
        .collect();
    list.join(", ")
}

/// Unit of the force of a joint.
fn force(motion: Motion) -> &'static str {
    unit_of(Kind::Torque, motion)
}
