//! Which parameters of a robot its joint torques can tell, and why not the others.

use excite::base::BaseParameters;
use excite::base::parts::Identifiability;
use excite::robot::parts::JointTerm;
use excite::{Error, Robot};

fn main() -> Result<(), Error> {
    let robot = Robot::load("scara")?.with_terms(&[JointTerm::Armature, JointTerm::Viscous]);
    let base = BaseParameters::new(&robot)?;
    println!(
        "{} base parameters, rank gap {:.1e}",
        base.count(),
        base.rank_gap
    );
    for a in 0..base.count() {
        println!("  {}", base.combination(a));
    }
    println!("never felt:");
    for p in &base.standard {
        if p.identifiability == Identifiability::None {
            println!("  {}: {}", p.name, p.reason);
        }
    }
    Ok(())
}
