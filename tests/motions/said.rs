//! What a report says of joints of which a motion tells nothing.

use excite::identifiability::{Assessment, assess};
use excite::trajectory::parts::{Ends, Series};
use excite::trajectory::{Fourier, Trajectory};
use excite::{Plant, Robot, WarningKind};

const URDF: &str = r#"<robot name="hand"><link name="base"/>
<link name="arm"><inertial><origin xyz="0.2 0 0"/><mass value="2"/><inertia ixx="0.005" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/></inertial></link>
<link name="finger"><inertial><origin xyz="0.02 0 0"/><mass value="0.02"/><inertia ixx="1e-6" ixy="0" ixz="0" iyy="1e-6" iyz="0" izz="1e-6"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 -1 0"/><limit lower="-3" upper="3" velocity="3" effort="60"/></joint>
<joint name="grip" type="prismatic"><parent link="arm"/><child link="finger"/><origin xyz="0.4 0 0"/><axis xyz="1 0 0"/><limit lower="0" upper="0.04" velocity="0.2" effort="20"/></joint>
</robot>"#;

/// A swing of the arm while the finger slides; `noise` of its drive, N.
fn swing(amplitude: f64, noise: f64) -> Assessment {
    let toml = format!(
        "name = \"hand\"\nurdf = \"hand.urdf\"\n[[joint]]\nname = \"shoulder\"\ntorque_noise = 0.1\n\
         [[joint]]\nname = \"grip\"\ntorque_noise = {noise:?}\n"
    );
    let robot = Robot::from_toml_str(&toml, URDF, "robot.toml").unwrap();
    let joints = [(0.0, amplitude), (0.02, 0.015 * amplitude)].map(|(constant, a)| Series {
        constant,
        sin: vec![a, 0.3 * a],
        cos: vec![0.0, 0.2 * a],
    });
    let fourier = Fourier::new(5.0, vec![1, 2], joints.to_vec()).unwrap();
    let trajectory = Trajectory {
        ends: Ends::Free,
        ..Trajectory::new(&robot, fourier)
    };
    assess(&Plant::from(robot), Some(&trajectory)).unwrap()
}

fn said(a: &Assessment, beginning: &str) -> Option<String> {
    let mut all = a.warnings.iter();
    let found = all.find(|w| w.kind == WarningKind::NotExcited && w.message.starts_with(beginning));
    found.map(|w| w.message.clone())
}

#[test]
fn a_finger_that_its_noise_hides_is_named_with_the_line_that_holds_it() {
    let lost = "the torque of grip (";
    let text = said(&swing(1.0, 5.0), lost).expect("a warning");
    assert!(text.contains(" of 5 N) is far below the noise"), "{text}");
    assert!(text.contains("`lock = { grip = 0.02 }`"), "{text}");
    // the shoulder is not, and neither is a finger whose drive is measured well
    assert!(!text.contains("shoulder"), "{text}");
    assert_eq!(said(&swing(1.0, 0.02), lost), None);
}

#[test]
fn a_joint_that_hardly_moves_is_named_with_the_line_that_holds_it() {
    let text = said(&swing(1e-3, 0.02), "it hardly moves shoulder (").expect("a warning");
    assert!(text.contains("`lock = { shoulder = 0 }`"), "{text}");
    assert_eq!(said(&swing(1.0, 0.02), "it hardly moves"), None);
}

/// A motion that stands still tells nothing. Nothing is known is not an uncertainty of nothing.
#[test]
fn what_is_not_known_at_all_is_infinite() {
    let a = swing(0.0, 0.02);
    let e = a.excitation.as_ref().unwrap();
    assert!(e.condition.invariant >= 1e300);
    assert!(e.elsewhere.relative(&a.torque_noise) > 1e6);
    let text = said(&a, "it does not excite every base parameter").expect("a warning");
    assert!(text.ends_with("is infinite"), "{text}");
}
