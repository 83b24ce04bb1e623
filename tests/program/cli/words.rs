//! What the commands say of themselves.

use super::*;

#[test]
fn every_command_has_help_with_an_example() {
    let t = Test::new();
    for command in [
        "design",
        "identifiability",
        "simulate",
        "identify",
        "load",
        "diagnose",
        "torque",
        "robots",
        "new",
    ] {
        let out = t.run(&format!("{command} --help"));
        assert_eq!(out.status, 0);
        assert!(out.stdout.contains("Example"), "{command}");
        assert!(
            out.stdout.contains(&format!("excite {command}")),
            "{command}"
        );
    }
}

/// The table of warnings in the documents is the list in the code.
#[test]
fn every_kind_of_warning_is_documented() {
    let text = include_str!("../../../docs/formats.md");
    let table = text.split("## Warnings").nth(1).unwrap();
    let table = table.split("\n## ").next().unwrap();
    let written: Vec<&str> = table
        .lines()
        .filter_map(|l| l.strip_prefix("| `")?.split('`').next())
        .filter(|code| *code != "kind")
        .collect();
    let codes: Vec<&str> = excite::WarningKind::ALL.iter().map(|k| k.code()).collect();
    assert_eq!(written, codes);
}

/// Long help, with an example, for every command.
#[test]
fn every_command_explains_itself() {
    let t = Test::new();
    let list = t.run("--help").stdout;
    let commands = list.split("Commands:").nth(1).unwrap();
    let commands = commands.split("Options:").next().unwrap();
    let mut seen = Vec::new();
    for line in commands
        .lines()
        .filter(|l| l.starts_with("  ") && !l.starts_with("   "))
    {
        let mut words = line.split_whitespace();
        let name = words.next().unwrap();
        assert!(
            words.next().is_some(),
            "nothing is said of {name} in\n{list}"
        );
        if name == "help" {
            continue;
        }
        let help = t.run(&format!("{name} --help"));
        assert_eq!((help.status, help.stderr.as_str()), (0, ""), "{name}");
        assert!(
            help.stdout.contains(&format!("  excite {name}")) && help.stdout.contains("Example"),
            "no example for {name}:\n{}",
            help.stdout
        );
        // what only the long help says stands before the usage
        let about = |text: &str| text.split("Usage:").next().unwrap().trim().to_string();
        let (long, short) = (
            about(&help.stdout),
            about(&t.run(&format!("{name} -h")).stdout),
        );
        if name != "robots" {
            assert!(
                long.len() > short.len() + 40,
                "{name}: the long help is\n{long}"
            );
        }
        assert!(!short.contains('\n'), "{name}: {short}");
        seen.push(name.to_string());
    }
    assert!(seen.len() >= 9, "{seen:?}");
}

/// The options of `simulate` are called as the diagnosis calls the effects.
#[test]
fn simulated_effects_have_the_names_of_the_catalogue() {
    let t = Test::new();
    let help = t.run("simulate --help").stdout;
    for effect in [
        "payload",
        "stribeck_friction",
        "nonlinear_viscous_friction",
        "friction_asymmetry",
        "load_dependent_friction",
        "torque_constant",
        "joint_offset",
        "torque_delay",
        "gravity_direction",
    ] {
        let option = format!("--{}", effect.replace('_', "-"));
        assert!(help.contains(&option), "{option} is not in\n{help}");
    }
    for gone in [
        "quadratic",
        "load-friction",
        "torque-gain",
        "position-offset",
        "tilt",
    ] {
        t.fails(&format!("simulate planar2 t.json --{gone} 1"), 2, &[gone]);
    }
}

/// 1 for what cannot be done, 2 for arguments that cannot be used; nothing on standard output.
#[test]
fn every_command_keeps_to_the_exit_status() {
    let t = Test::new().file("arm.toml", "urdf = 3");
    for line in [
        "design none.toml",
        "design arm.toml",
        "identifiability none.urdf",
        "identifiability planar2 none.json",
        "identify none.toml",
        "diagnose none.toml",
        "condense none.toml",
        "merge none.factor",
        "merge arm.toml",
        "export planar2 --to mujoco --into none.xml",
        "export delta --to sdf",
        "load none.toml",
        "torque planar2 none.csv",
        "simulate planar2 none.json",
        "new none.urdf",
    ] {
        t.fails(line, 1, &["error: "]);
    }
    for line in [
        "design",
        "design no_such_robot",
        "design planar2 --period 0",
        "design planar2 --rate 1e300",
        "identifiability",
        "identify",
        "identify e.toml --method magic",
        "diagnose",
        "merge",
        "export planar2 --to usd --into arm.toml",
        "export planar2 --to webots",
        "load",
        "load e.toml --cutoff -1",
        "torque planar2",
        "simulate planar2",
        "new",
        "new arm.toml",
        "robots --nonsense",
        "nonsense",
    ] {
        t.fails(line, 2, &[]);
    }
    assert!(!t.path().join("out").exists(), "a failure makes no folder");
}
