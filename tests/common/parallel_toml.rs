//! Robot files of the reference models.
#![allow(dead_code)]

use super::parallel::numbers;
use serde_json::Value;
use std::fmt::Write;

fn list(v: &Value) -> String {
    let all: Vec<String> = numbers(v).iter().map(|x| format!("{x:?}")).collect();
    format!("[{}]", all.join(", "))
}

fn body(v: &Value) -> String {
    let i = |r: usize, c: usize| v["Ic"][r][c].as_f64().unwrap();
    format!(
        "mass = {:?}, com = {}, inertia = [{:?}, {:?}, {:?}, {:?}, {:?}, {:?}]",
        v["m"].as_f64().unwrap(),
        list(&v["c"]),
        i(0, 0),
        i(0, 1),
        i(0, 2),
        i(1, 1),
        i(1, 2),
        i(2, 2)
    )
}

fn lines(inline: &str) -> String {
    // a comma inside brackets separates numbers
    let mut depth = 0;
    inline
        .chars()
        .map(|c| {
            depth += (c == '[') as i32 - (c == ']') as i32;
            if c == ',' && depth == 0 { '\n' } else { c }
        })
        .collect()
}

/// The hexapod, with further keys at the top and of the actuators.
pub fn hexapod(model: &Value, top: &str, actuator: &str) -> String {
    let mut t = format!(
        "name = \"sg\"\nmechanism = \"gough-stewart\"\ngravity = {}\n\
         home = [0, 0, {:?}, 0, 0, 0]\n{top}\n[actuator]\n{actuator}\n[platform]\n{}\n\
         [legs]\ncross = {{ mass = 0 }}\n",
        list(&model["g"]),
        model["neutral_height"].as_f64().unwrap(),
        lines(&body(&model["platform"]))
    );
    for leg in model["legs"].as_array().unwrap() {
        let rows: Vec<String> = leg["R0"].as_array().unwrap().iter().map(list).collect();
        let _ = write!(
            t,
            "[[leg]]\nbase = {}\nplatform = {}\nrotation = [{}]\ncylinder = {{ {} }}\n\
             rod = {{ {} }}\n",
            list(&leg["a"]),
            list(&leg["b"]),
            rows.join(", "),
            body(&leg["A"]),
            body(&leg["B"])
        );
    }
    t
}

/// H4 or Delta.
pub fn chains(model: &Value, kind: &str, top: &str, actuator: &str) -> String {
    let h4 = kind == "h4";
    let number = |k: &str| model[k].as_f64().unwrap();
    let mut t = format!(
        "mechanism = \"{kind}\"\ngravity = {}\nhome = [0, 0, -0.45{}]\n{top}\n[actuator]\n\
         {actuator}\n[platform]\n{}\n[chains]\narm_length = {:?}\nrod_length = {:?}\nwidth = {:?}\n",
        list(&model["g"]),
        if h4 { ", 0" } else { "" },
        lines(&body(&model["D"])),
        number("L"),
        number("l"),
        number("w")
    );
    if h4 {
        for k in 0..2 {
            let _ = write!(
                t,
                "[[bar]]\nhinge = {}\n{}\n",
                list(&model["hinges"][k]),
                lines(&body(&model["bars"][k]))
            );
        }
    }
    for (i, c) in model["chains"].as_array().unwrap().iter().enumerate() {
        let _ = write!(
            t,
            "[[chain]]\nmotor = {}\nazimuth = {:?}\nattachment = {}\narm = {{ {} }}\n\
             rods = [{{ {} }}, {{ {} }}]\n",
            list(&c["P"]),
            c["azimuth"].as_f64().unwrap(),
            list(&c["beta"]),
            body(&c["arm"]),
            body(&c["rods"][0]),
            body(&c["rods"][1])
        );
        if h4 {
            let _ = writeln!(t, "bar = {}", 1 + c["plate"].as_u64().unwrap());
        }
        let _ = write!(
            t,
            "[[joint]]\nname = \"motor{}\"\narmature = {:?}\n",
            i + 1,
            c["armature"].as_f64().unwrap()
        );
    }
    t
}
