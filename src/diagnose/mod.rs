//! Diagnosis of the gap between a model and its robot.

pub mod catalogue;
pub mod closed;
pub mod data;
pub mod evidence;
pub mod noise;
pub mod record;
pub mod search;

use crate::error::Result;
use crate::plant::Plant;
use record::{Raw, Record};

/// debug
pub fn explore(plant: &Plant, raws: &[Raw]) -> Result<()> {
    let t0 = std::time::Instant::now();
    let records = raws
        .iter()
        .map(|r| Record::prepare(plant, r))
        .collect::<Result<Vec<_>>>()?;
    for r in &records {
        eprintln!("{} band {:.1} n {} cycle {:?} qn {:?}", r.name, r.band, r.count, r.cycle, r.position_noise);
    }
    let mut data = data::Data::new(plant, records)?;
    eprintln!("data {:?}", t0.elapsed());
    {
        let e = evidence::Evidence::new(&data, 1.0);
        let none = e.fit(&[]);
        let phi = e.parameters(&[], &none);
        let model = data.model_torque(&phi);
        let res: Vec<Vec<f64>> = (0..data.joints()).map(|j| data.tau[j].iter().zip(&model[j]).map(|(a, b)| a - b).collect()).collect();
        data.limit_excess(&res);
    }
    let e = evidence::Evidence::new(&data, 1.0);
    eprintln!("evidence {:?}", t0.elapsed());
    let none = e.fit(&[]);
    let phi = e.parameters(&[], &none);
    let residual = e.residual(&[], &none);
    let energy = e.energy(&residual);
    for j in 0..data.joints() {
        let per: Vec<String> = (0..data.records.len()).map(|k| format!("{:.3}", energy.joints[j][k] / data.records[k].count as f64)).collect();
        eprintln!("joint {j} noise {:.4} J/N {per:?}", data.noise[j].std);
    }
    let chi = energy.sum(|k| data.records[k].fit);
    eprintln!("J0 {:.0} chi2 {:.0} pen {:.1} N {}", e.j0, chi, e.j0 - chi, data.fitted * data.joints());
    let cx = catalogue::Context::new(&data, phi)?;
    let effects = catalogue::all();
    let all = search::singles(&e, &cx, &effects, &[]);
    eprintln!("search {:?}", t0.elapsed());
    for c in all.iter().take(14) {
        let vis: f64 = (0..c.eta.len()).map(|i| c.projected.s[(i, i)] * c.eta[i] * c.eta[i]).sum::<f64>()
            / (0..c.eta.len()).map(|i| c.projected.raw[(i, i)] * c.eta[i] * c.eta[i]).sum::<f64>();
        let set = [&c.projected];
        let f = e.fit(&set);
        let en = e.energy(&e.residual(&set, &f));
        let hold0 = energy.sum(|k| !data.records[k].fit);
        let hold1 = en.sum(|k| !data.records[k].fit);
        let chi1 = en.sum(|k| data.records[k].fit);
        println!("{:28} {:?} shape {:?} gain {:.0} chigain {:.0} hold {:.0} -> {:.0} vis {:.3} eta {:?}", effects[c.effect].card().name, c.place, c.shape, c.gain, chi - chi1, hold0, hold1, vis, c.eta);
    }
    Ok(())
}
