//! `excite new FILE.urdf`, `excite new hexapod|h4|delta`.

use excite::mechanism::bundled::{self, Bundled};
use excite::output::prepare_dir;
use excite::{Error, Plant, Result, Robot};
use std::path::{Component, Path, PathBuf};

/// Write a commented robot.toml for a URDF or a parallel robot
#[derive(clap::Args)]
#[command(
    long_about = "Write a commented robot.toml for a URDF: all joints with their present limits, and every key that \
                  can be added. For a hexapod, H4 or Delta: a commented robot.toml to put the dimensions of your machine into, \
                  and the experiment.toml of a campaign that load, identify and diagnose read.\n\nThe path of the URDF in it is relative to the folder of the new file: that of \
                  --output, or of the file that standard output goes to. In a pipe it is relative to the working \
                  directory.",
    after_help = "Examples:\n  excite new arm.urdf > robot.toml\n  excite new description/arm.urdf --output robots/arm.toml\n  excite new hexapod --output machine"
)]
pub struct Args {
    /// URDF or xacro file (with its arguments, "arm.urdf.xacro name:=value"), or one of hexapod, h4, delta
    #[arg(value_name = "FILE.urdf|hexapod|h4|delta")]
    urdf: PathBuf,
    /// File to write [default: standard output]; of a parallel robot the folder of robot.toml and experiment.toml [default: .]
    #[arg(short, long, value_name = "FILE.toml|DIR")]
    output: Option<PathBuf>,
    /// Folder in which package:// meshes are looked for, before the URDF's own and
    /// ROS_PACKAGE_PATH; may be given several times
    #[arg(long, value_name = "FOLDER")]
    meshes: Vec<PathBuf>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

pub fn run(args: Args) -> Result<()> {
    let named = args.urdf.to_str().and_then(bundled::find);
    if let Some(kind) = named {
        if !args.meshes.is_empty() {
            return Err(Error::Argument(format!(
                "--meshes goes with a URDF; `excite new {}` reads no meshes",
                kind.name
            )));
        }
        return parallel(kind, &args);
    }
    let spec = args.urdf.to_string_lossy();
    // arguments of a xacro stand behind its path
    let path = spec.split(' ').next().unwrap_or(&spec);
    let described = [&*spec, path].iter().any(|s| {
        let extension = Path::new(s).extension();
        extension.is_some_and(|e| e == "urdf" || e == "xacro")
    });
    if !described {
        return Err(Error::Argument(format!(
            "`{}` is neither a .urdf nor a .xacro file, for which `excite new` writes the robot.toml that goes with it, nor one of hexapod, \
             h4, delta",
            args.urdf.display()
        )));
    }
    let mut robot = Robot::load(&spec)?;
    robot.geometry.look_in(&args.meshes);
    super::warn(&robot.warnings);
    super::warn(&robot.geometry.volumes().warnings);
    let robot = Plant::from(&robot).lend_volumes(&robot);
    let folder = match &args.output {
        Some(file) => file.parent().map(Path::to_path_buf),
        None => standard_output().and_then(|file| file.parent().map(Path::to_path_buf)),
    };
    let urdf = match folder {
        Some(folder) => relative(&folder, &args.urdf),
        None => args.urdf.clone(),
    };
    let text = robot.to_toml_template(&urdf.to_string_lossy());
    match &args.output {
        None => super::print(&text),
        Some(file) => {
            if let Some(folder) = file.parent().filter(|f| !f.as_os_str().is_empty()) {
                std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, e))?;
            }
            super::write(file, args.force, &text)?;
            super::print(&format!("wrote {}\n", file.display()))
        }
    }
}

/// `robot.toml` and `experiment.toml` of a parallel robot.
fn parallel(kind: &Bundled, args: &Args) -> Result<()> {
    let folder = args.output.clone().unwrap_or_else(|| PathBuf::from("."));
    if folder.extension().is_some_and(|e| e == "toml") {
        return Err(Error::Argument(format!(
            "--output {}: `excite new {}` writes robot.toml and experiment.toml; name their folder",
            folder.display(),
            kind.name
        )));
    }
    let files = prepare_dir(&folder, &["robot.toml", "experiment.toml"], args.force)?;
    super::write(&files[0], args.force, &robot(kind))?;
    super::write(&files[1], args.force, &experiment(kind))?;
    super::print(&format!(
        "wrote {}\nwrote {}\n",
        files[0].display(),
        files[1].display()
    ))
}

/// What of the file belongs to the machine and not to its kind.
fn robot(kind: &Bundled) -> String {
    let dimensions = match kind.name {
        "hexapod" => {
            "joints of base and platform ([[leg]] with `base` and `platform` each where they lie on no circle), `zero`, \
                      strokes"
        }
        _ => "axes of the motors, lengths of arms and rods, attachments, zeros of the encoders",
    };
    let pistons = "effort = 900.0\n# piston = [1.963e-3, 1.649e-3]  # m2: chamber a, which extends, and b; logs may then hold \
                   pressures pa1 pb1 .. in Pa instead of tau1 ..\n";
    format!(
        "# To be filled in for your machine. What stands here is the bundled `{}`, whose figures are mostly estimates.\n\
         # 1. Dimensions: {dimensions}. Millimetres matter: `excite calibrate` finds them.\n\
         # 2. Limits of [workspace] and [actuator], which every motion will keep.\n\
         # 3. torque_noise and position_resolution: what the report before a run promises follows from these.\n\
         # 4. Masses: those of legs, arms and rods count as known in `excite load`; the platform is found from a record of the empty\n\
         #    robot. `bodies` and `identify` say what `excite identify` finds.\n\
         # SI units: m, rad, s, kg, N, N m. Tensors xx, xy, xz, yy, yz, zz about the centre of mass. All keys: docs/formats.md\n\n{}",
        kind.name,
        kind.toml.replacen("effort = 900.0\n", pistons, 1)
    )
}

/// A campaign: the empty robot, its holdout, and the load.
fn experiment(kind: &Bundled) -> String {
    let period = excite::design::parts::Question::Load.motion().1;
    format!(
        "# Campaign of a {}, for motions of `excite design robot.toml --for load` and a second one with another --seed.\n\
         # Logs: t, q1.. (positions of the actuators), tau1.. (or chamber pressures, see `piston` in robot.toml), from the start\n\
         # of the motion, all periods without a pause. A record that you do not have is left out by deleting its block.\n\
         #   excite load experiment.toml        the load, from empty.csv and loaded.csv\n\
         #   excite identify experiment.toml    the machine, from empty.csv, judged by holdout.csv\n\
         #   excite diagnose experiment.toml    what of the model is wrong\n\
         robot = \"robot.toml\"\n\
         \n[[record]]\nlog = \"empty.csv\"\nuse = \"fit\"\nperiod = {period:?}        # s; leave out where the motion does not \
         repeat\npayload = \"none\"\n\
         \n[[record]]\nlog = \"holdout.csv\"   # another motion, only predicted\nuse = \"holdout\"\nperiod = {period:?}\npayload = \"none\"\n\
         \n[[record]]\nlog = \"loaded.csv\"    # the motion of empty.csv within the same hour\nuse = \"fit\"\nperiod = {period:?}\npayload = \
         \"unknown\"\n\
         \n# A weight of known mass on the same motion tells the gains of the drives:\n\
         # [[record]]\n# log = \"weight.csv\"\n# use = \"fit\"\n# period = {period:?}\n# payload = {{ mass = 5.0 }}\n",
        kind.name
    )
}

/// The file that standard output goes to, where the system tells and it is one.
fn standard_output() -> Option<PathBuf> {
    let file = std::fs::read_link("/proc/self/fd/1").ok()?;
    file.is_file().then_some(file)
}

/// `file` as it is called in `folder`; as it is where no relative path leads there.
fn relative(folder: &Path, file: &Path) -> PathBuf {
    if file.is_absolute() {
        return file.to_path_buf();
    }
    let parts = |path: &Path| -> Vec<PathBuf> {
        // links are followed as far as the path exists, so that `..` leads where it should
        let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        let real = absolute
            .ancestors()
            .find_map(|a| Some((a, a.canonicalize().ok()?)))
            .and_then(|(a, real)| Some(real.join(absolute.strip_prefix(a).ok()?)))
            .unwrap_or(absolute);
        real.components()
            .filter(|c| !matches!(c, Component::CurDir))
            .map(|c| PathBuf::from(c.as_os_str()))
            .collect()
    };
    let name = file.file_name().map(PathBuf::from).unwrap_or_default();
    let home = match file.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    let folder = match folder.as_os_str().is_empty() {
        true => Path::new("."),
        false => folder,
    };
    let (from, to) = (parts(folder), parts(home));
    let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    if common == 0 {
        return std::path::absolute(file).unwrap_or_else(|_| file.to_path_buf());
    }
    let up = std::iter::repeat_n(PathBuf::from(".."), from.len() - common);
    up.chain(to[common..].iter().cloned())
        .chain([name])
        .collect()
}
