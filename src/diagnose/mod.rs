//! Diagnosis of the gap between a model and its robot.

pub mod catalogue;
pub mod closed;
pub mod data;
pub mod evidence;
pub mod gap;
pub mod noise;
pub mod record;
pub mod search;
pub mod verdict;

use crate::error::Result;
use crate::plant::Plant;
use record::{Raw, Record};

/// Records ready for the diagnosis: noise, ordinary imperfections.
pub fn prepare<'a>(plant: &'a Plant, raws: &[Raw]) -> Result<data::Data<'a>> {
    let likely: Vec<f64> = raws.iter().filter_map(|r| r.period).collect();
    let records = raws
        .iter()
        .map(|r| Record::prepare(plant, r, &likely))
        .collect::<Result<Vec<_>>>()?;
    let mut data = data::Data::new(plant, records)?;
    // the width of the window of the torque channel, then what the encoders cannot resolve
    for pass in 0..2 {
        let e = evidence::Evidence::new(&data, 1.0);
        let none = e.fit(&[]);
        let phi = e.parameters(&[], &none);
        let model = data.model_torque(&phi);
        let wider = e.project(&[data.curvature(&model)]);
        let found = e.fit(&[&wider]).eta[0];
        drop(e);
        data.window = (data.window + found).clamp(0.0, 3.0);
        if pass == 0 {
            let residual: Vec<Vec<f64>> = (0..data.joints())
                .map(|j| {
                    let model = data.windowed(&model[j]);
                    data.tau[j].iter().zip(&model).map(|(a, b)| a - b).collect()
                })
                .collect();
            data.limit_excess(&residual);
        }
    }
    data.ordinary();
    Ok(data)
}

/// debug
pub fn explore(plant: &Plant, raws: &[Raw]) -> Result<()> {
    let t0 = std::time::Instant::now();
    let data = prepare(plant, raws)?;
    let e = evidence::Evidence::new(&data, 1.0);
    eprintln!("evidence {:?}", t0.elapsed());
    let none = e.fit(&[]);
    let phi = e.parameters(&[], &none);
    let residual = e.residual(&[], &none);
    let energy = e.energy(&residual);
    for j in 0..data.joints() {
        let per: Vec<String> = (0..data.records.len()).map(|k| { let (a, b) = gap::excess(&data.records[k], &residual[j][data.span(k)]); format!("{:.3} {:.3} {:.3}", energy.joints[j][k] / data.records[k].count as f64, a / data.records[k].count as f64, b / data.records[k].count as f64)}).collect();
        eprintln!("joint {j} noise {:.4} J/N {per:?}", data.noise[j].std);
    }
    let chi = energy.sum(|k| data.records[k].fit);
    eprintln!("window {:.3} J0 {:.0} chi2 {:.0} pen {:.1} N {} nuisance {:?}", data.window, e.j0, chi, e.j0 - chi, data.fitted * data.joints(), data.parameters.iter().zip(&phi).zip(&data.spread).filter(|((p, _), _)| p.name == "reversal" || p.name == "log.skew").map(|((_, v), s)| v / s).collect::<Vec<_>>());
    let cx = catalogue::Context::new(&data, phi)?;
    let effects = catalogue::all();
    let all = search::singles(&e, &cx, &effects, &[]);
    eprintln!("search {:?}", t0.elapsed());
    for c in all.iter().take(8) {
        let set = [&c.projected];
        let f = e.fit(&set);
        let en = e.energy(&e.residual(&set, &f));
        let hold0 = energy.sum(|k| !data.records[k].fit);
        let hold1 = en.sum(|k| !data.records[k].fit);
        let chi1 = en.sum(|k| data.records[k].fit);
        println!("   {:28} {:?} shape {:?} gain {:.0} chigain {:.0} hold {:.0} -> {:.0} eta {:?}", effects[c.effect].card().name, c.place, c.shape, c.gain, chi - chi1, hold0, hold1, c.eta);
    }
    let d = verdict::decide(&e, &cx, &effects, &all, &|_| ());
    eprintln!("decided {:?}", t0.elapsed());
    println!("=> {:?} unexplained {:.3} before {:.0?} after {:.0?} hold {:.0?} surprise {:.0?}", d.verdict, d.unexplained, d.before, d.after, d.holdout, d.surprise);
    for m in &d.members {
        let c = &m.candidate;
        println!("=> {:28} {:?} conf {:.3} expl {:.3} hold {:.3} vis {:.3} frozen {} shape {:?}", effects[c.effect].card().name, c.place, m.confidence, m.explains, m.holdout, m.visibility, m.frozen, c.shape);
        for v in effects[c.effect].values(&cx, &c.place, &c.shape, &c.eta, &m.std) {
            println!("        {} {:.5} ± {:?} {}", v.name, v.value, v.std, v.unit);
        }
        for r in m.rivals.iter().take(5) {
            println!("        rival {} {:?} loss {:.3} w {:.3}", effects[r.effect].card().name, r.place, r.loss, r.weight);
        }
    }
    Ok(())
}
