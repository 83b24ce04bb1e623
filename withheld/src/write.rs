//! The files of a case: what the diagnosis may see, and apart from it the answers.

use crate::case::Case;
use crate::effects;
use crate::robots::Machine;
use crate::simulate::Log;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;

/// Writes the folder of a case: robot, experiment and logs.
pub fn case(case: &Case, folder: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    let name = format!("case_{:03}", case.plan.index);
    std::fs::write(folder.join("robot.urdf"), urdf(&case.machine, &name))?;
    std::fs::write(folder.join("robot.toml"), toml(&case.machine, &name))?;
    let mut experiment = String::from("robot = \"robot.toml\"\n");
    for (record, log) in case.records.iter().zip(&case.logs) {
        let use_ = if record.fit { "fit" } else { "holdout" };
        let _ = write!(
            experiment,
            "\n[[record]]\nlog = \"{}.csv\"\nuse = \"{use_}\"\nperiod = {:?}\n",
            record.name, record.period
        );
        std::fs::write(folder.join(format!("{}.csv", record.name)), csv(log))?;
    }
    std::fs::write(folder.join("experiment.toml"), experiment)
}

fn csv(log: &Log) -> String {
    let n = log.q.len();
    let mut s = String::from("t");
    for prefix in ["q", "tau"] {
        for j in 1..=n {
            let _ = write!(s, ",{prefix}{j}");
        }
    }
    s.push('\n');
    for i in 0..log.t.len() {
        let _ = write!(s, "{:.5}", log.t[i]);
        for q in &log.q {
            let _ = write!(s, ",{:.7}", q[i]);
        }
        for tau in &log.tau {
            let digits = 4 - (tau[i].abs().max(1e-6).log10().floor() as i32).clamp(-4, 4);
            let _ = write!(s, ",{:.*}", digits.max(0) as usize, tau[i]);
        }
        s.push('\n');
    }
    s
}

/// The nominal bodies as URDF.
pub fn urdf(m: &Machine, name: &str) -> String {
    let mut s =
        format!("<?xml version=\"1.0\"?>\n<robot name=\"{name}\">\n  <link name=\"base\"/>\n");
    for (i, (joint, drive)) in m
        .nominal_chain
        .joints
        .iter()
        .zip(&m.nominal_drives)
        .enumerate()
    {
        let parent = if i == 0 {
            "base".into()
        } else {
            format!("link{i}")
        };
        let (roll, pitch, yaw) =
            nalgebra::Rotation3::from_matrix_unchecked(joint.rotation).euler_angles();
        let kind = if joint.prismatic {
            "prismatic"
        } else {
            "revolute"
        };
        let (p, com, t) = (joint.position, joint.body.com(), joint.body.tensor_com());
        let _ = write!(
            s,
            r#"  <joint name="{}" type="{kind}">
    <parent link="{parent}"/><child link="link{}"/>
    <origin xyz="{:.9} {:.9} {:.9}" rpy="{roll:.15} {pitch:.15} {yaw:.15}"/>
    <axis xyz="0 0 1"/>
    <limit lower="{:.5}" upper="{:.5}" velocity="{:.4}" effort="{:.5}"/>
  </joint>
  <link name="link{}">
    <inertial>
      <origin xyz="{:.9} {:.9} {:.9}" rpy="0 0 0"/>
      <mass value="{:.9}"/>
      <inertia ixx="{:.9e}" ixy="{:.9e}" ixz="{:.9e}" iyy="{:.9e}" iyz="{:.9e}" izz="{:.9e}"/>
    </inertial>
  </link>
"#,
            drive.name,
            i + 1,
            p.x,
            p.y,
            p.z,
            drive.range[0],
            drive.range[1],
            drive.velocity,
            drive.effort,
            i + 1,
            com.x,
            com.y,
            com.z,
            joint.body.mass,
            t[(0, 0)],
            t[(0, 1)],
            t[(0, 2)],
            t[(1, 1)],
            t[(1, 2)],
            t[(2, 2)],
        );
    }
    s.push_str("</robot>\n");
    s
}

/// What the URDF cannot say of the nominal model.
pub fn toml(m: &Machine, name: &str) -> String {
    let prior = if m.identified { "identified" } else { "cad" };
    let mut s = format!(
        "name = \"{name}\"\nurdf = \"robot.urdf\"\nprior = \"{prior}\"\ngravity = [0.0, 0.0, -9.81]\n"
    );
    for d in &m.nominal_drives {
        let terms: Vec<&str> = ["\"armature\"", "\"viscous\"", "\"coulomb\"", "\"offset\""]
            .into_iter()
            .zip(d.identify)
            .filter_map(|(t, used)| used.then_some(t))
            .collect();
        let _ = write!(
            s,
            "\n[[joint]]\nname = \"{}\"\nvelocity = {:.4}\nacceleration = {:.4}\neffort = {:.5}\n\
             torque_noise = {:.6}\nposition_resolution = {:e}\ngear_ratio = {}\narmature = {:.7}\n\
             viscous = {:.7}\ncoulomb = {:.7}\noffset = {:.7}\nidentify = [{}]\n",
            d.name,
            d.velocity,
            d.acceleration,
            d.effort,
            d.noise,
            d.resolution,
            d.gear,
            d.armature,
            d.viscous,
            d.coulomb,
            d.offset,
            terms.join(", ")
        );
    }
    s
}

/// The answers to one case.
pub fn truth(case: &Case) -> Value {
    let m = &case.machine;
    let f = &case.figures;
    let names = |joints: Vec<usize>| -> Vec<String> {
        joints
            .into_iter()
            .map(|j| m.drives[j].name.clone())
            .collect()
    };
    let list: Vec<Value> = case
        .effects
        .iter()
        .enumerate()
        .map(|(i, e)| {
            let frozen = effects::entry(e.name).is_some_and(|e| e.1);
            let level = if frozen {
                f.visible_frozen[i]
            } else {
                f.visible[i]
            };
            json!({
                "name": e.name,
                "joints": names(effects::joints(e, m)),
                "equivalent": effects::equivalents(e, m),
                "tolerated": effects::tolerated(e.name),
                "judged": if frozen { "frozen" } else { "visible" },
                "level": level,
                "visible_over_noise": f.visible[i],
                "frozen_over_noise": f.visible_frozen[i],
                "parameters": { "strength": e.strength, "shape": e.shape },
            })
        })
        .collect();
    let [before, refit, refit_true, prior_true] = f.holdout;
    json!({
        "case": format!("case_{:03}", case.plan.index),
        "kind": case.plan.kind,
        "robot": m.family,
        "joints": m.drives.iter().map(|d| d.name.clone()).collect::<Vec<_>>(),
        "prior": if m.identified { "identified" } else { "cad" },
        "creep_record": case.records.iter().any(|r| r.creep),
        "effects": list,
        "nuisance": if m.identified { json!([]) } else {
            json!(["link_inertia", "viscous_friction", "coulomb_friction", "rotor_inertia", "torque_offset"])
        },
        "frozen_rms_over_noise": f.frozen,
        "refit_rms_over_noise": f.refit,
        "oracle": {
            "holdout": { "before": before, "refit": refit, "refit_true": refit_true, "prior_true": prior_true,
                         "shrink_refit": 1.0 - refit_true / refit, "shrink_frozen": 1.0 - refit_true.min(prior_true) / before },
            "unit": "mean squared residual over noise variance, noise-free torque below 30 Hz"
        },
    })
}
