//! Answers against what the diagnosis said: the one place that opens both.

use serde_json::Value;

/// A finding with at least this confidence is a claim.
pub const CLAIM: f64 = 0.5;
/// From this level on, in multiples of the torque noise, an effect counts as clearly visible.
pub const CLEAR: f64 = 1.0;

/// One finding of a `diagnosis.json`.
#[derive(Clone, Debug)]
pub struct Finding {
    pub effect: String,
    pub joints: Vec<String>,
    pub confidence: f64,
    pub holdout_shrink: Option<f64>,
    pub same: Vec<String>,
}

/// What one effect of a case came to.
#[derive(Clone, Debug)]
pub struct Outcome {
    pub name: String,
    /// Its size: residual it leaves, over the torque noise.
    pub level: f64,
    /// Its place among the findings, from 0, names of ordinary parameter errors left out.
    pub rank: Option<usize>,
    /// A right name is claimed.
    pub claimed: bool,
    /// The first finding names it or lists it among what it cannot tell apart.
    pub in_set: bool,
    /// The joints of the right finding are the true ones; none where it is not tied to joints.
    pub joint: Option<bool>,
    /// Held-out shrink of the right finding over that with the true effect.
    pub shrink: Option<f64>,
}

/// The judgement of a case.
#[derive(Clone, Debug)]
pub struct Judged {
    pub case: String,
    pub kind: String,
    /// Effect names as the answers give them, joined by `+`.
    pub truth: String,
    pub verdict: String,
    /// First claim that is no ordinary parameter error.
    pub answer: Option<String>,
    /// Claims that are neither right nor tolerated.
    pub wrong: Vec<String>,
    pub outcomes: Vec<Outcome>,
    /// Confidence of every finding and whether its name is right, names of ordinary parameter errors left out.
    pub names: Vec<(f64, bool)>,
    pub seconds: f64,
}

fn strings(v: &Value) -> Vec<String> {
    v.as_array()
        .map(|a| {
            a.iter()
                .filter_map(|x| x.as_str().map(Into::into))
                .collect()
        })
        .unwrap_or_default()
}

/// The findings of a diagnosis, most confident first.
pub fn findings(diagnosis: &Value) -> Result<Vec<Finding>, String> {
    let list = diagnosis["findings"]
        .as_array()
        .ok_or("no `findings` in diagnosis.json")?;
    let mut out = Vec::new();
    for f in list {
        out.push(Finding {
            effect: f["effect"]
                .as_str()
                .ok_or("a finding without `effect`")?
                .into(),
            joints: strings(&f["joints"]),
            confidence: f["confidence"]
                .as_f64()
                .ok_or("a finding without `confidence`")?,
            holdout_shrink: f["holdout_shrink"].as_f64(),
            same: strings(&f["indistinguishable_from"]),
        });
    }
    out.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    Ok(out)
}

/// Judges the diagnosis of one case by its entry in `truth.json`.
pub fn judge(truth: &Value, diagnosis: &Value, seconds: f64) -> Result<Judged, String> {
    let effects = truth["effects"]
        .as_array()
        .ok_or("no `effects` in the answers")?;
    let right: Vec<Vec<String>> = effects.iter().map(|e| strings(&e["equivalent"])).collect();
    let is_right = |name: &str| right.iter().flatten().any(|r| r == name);
    let mut excused = strings(&truth["nuisance"]);
    excused.extend(effects.iter().flat_map(|e| strings(&e["tolerated"])));
    let ranked: Vec<Finding> = findings(diagnosis)?
        .into_iter()
        .filter(|f| is_right(&f.effect) || !excused.contains(&f.effect))
        .collect();
    let claims: Vec<&Finding> = ranked.iter().filter(|f| f.confidence >= CLAIM).collect();
    let kind = truth["kind"].as_str().unwrap_or_default().to_string();
    let mut outcomes = Vec::new();
    // an effect outside the catalogue has no right name
    let named = if kind == "outside" {
        &[][..]
    } else {
        &effects[..]
    };
    for (e, names) in named.iter().zip(&right) {
        let rank = ranked.iter().position(|f| names.contains(&f.effect));
        let mut joints = strings(&e["joints"]);
        joints.sort();
        let frozen = e["judged"].as_str() == Some("frozen");
        let best = truth["oracle"]["holdout"][if frozen {
            "shrink_frozen"
        } else {
            "shrink_refit"
        }]
        .as_f64();
        let found = rank.map(|r| &ranked[r]);
        outcomes.push(Outcome {
            name: e["name"].as_str().unwrap_or_default().into(),
            level: e["level"].as_f64().unwrap_or(0.0),
            rank,
            claimed: claims.iter().any(|f| names.contains(&f.effect)),
            in_set: ranked.first().is_some_and(|f| {
                names.contains(&f.effect) || f.same.iter().any(|s| names.contains(s))
            }),
            joint: found.filter(|_| !joints.is_empty()).map(|f| {
                let mut said = f.joints.clone();
                said.sort();
                said == joints
            }),
            shrink: found
                .and_then(|f| f.holdout_shrink)
                .zip(best.filter(|b| *b > 0.2))
                .map(|(a, b)| a / b),
        });
    }
    let truth_name = effects
        .iter()
        .map(|e| e["name"].as_str().unwrap_or_default())
        .collect::<Vec<_>>()
        .join("+");
    Ok(Judged {
        case: truth["case"].as_str().unwrap_or_default().into(),
        kind,
        truth: truth_name,
        verdict: diagnosis["verdict"].as_str().unwrap_or_default().into(),
        answer: claims.first().map(|f| f.effect.clone()),
        wrong: claims
            .iter()
            .filter(|f| !is_right(&f.effect))
            .map(|f| f.effect.clone())
            .collect(),
        outcomes,
        names: (ranked.iter())
            .map(|f| (f.confidence, is_right(&f.effect)))
            .collect(),
        seconds,
    })
}
