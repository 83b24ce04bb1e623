//! The regressor and the inverse dynamics of many samples at once, without allocation in the loop.

use excite::base::random_states;
use excite::dynamics::Tree;
use excite::dynamics::parts::Workspace;
use excite::{Error, Robot};

fn main() -> Result<(), Error> {
    let robot = Robot::load("iiwa14")?;
    let tree = Tree::new(&robot);
    let motion = random_states(&robot, 1000, 7);
    let (rows, columns) = (motion.dof * motion.count, robot.parameter_count());

    let mut workspace = Workspace::default();
    let (mut w, mut tau) = (vec![0.0; rows * columns], vec![0.0; rows]);
    tree.regressor(&mut workspace, &motion, &mut w, rows);
    tree.inverse_dynamics(&mut workspace, &robot.parameters(), &motion, &mut tau);

    let phi = robot.parameters();
    let worst = (0..rows)
        .map(|row| {
            let y_phi: f64 = (0..columns).map(|c| w[c * rows + row] * phi[c]).sum();
            (y_phi - tau[row]).abs()
        })
        .fold(0.0, f64::max);
    println!(
        "{rows} rows, {columns} columns: Y phi and recursive Newton-Euler differ by {worst:.1e} N m"
    );
    Ok(())
}
