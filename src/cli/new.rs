//! `excite new FILE.urdf`.

use excite::{Error, Result, Robot};
use std::path::{Component, Path, PathBuf};

/// Write a commented robot.toml for a URDF.
#[derive(clap::Args)]
#[command(
    long_about = "Write a commented robot.toml for a URDF: all joints with their present limits, and every key that \
                  can be added.\n\nThe path of the URDF in it is relative to the folder of the new file: that of \
                  --output, or of the file that standard output goes to. In a pipe it is relative to the working \
                  directory.",
    after_help = "Examples:\n  excite new arm.urdf > robot.toml\n  excite new description/arm.urdf --output robots/arm.toml"
)]
pub struct Args {
    /// URDF file
    urdf: PathBuf,
    /// File to write [default: standard output]
    #[arg(short, long, value_name = "FILE.toml")]
    output: Option<PathBuf>,
    /// Replace the file if it exists
    #[arg(long)]
    force: bool,
}

pub fn run(args: Args) -> Result<()> {
    if args.urdf.extension().is_none_or(|e| e != "urdf") {
        return Err(Error::Argument(format!(
            "`{}` is not a .urdf file; `excite new` writes the robot.toml that goes with one",
            args.urdf.display()
        )));
    }
    let robot = Robot::load(&args.urdf.to_string_lossy())?;
    super::warn(&robot.warnings);
    super::warn(&robot.geometry.volumes().warnings);
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
