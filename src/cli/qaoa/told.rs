//! A run of QAOA alone, as one JSON document and in words.

use std::fmt::Write;

use serde_json::{Map, Value, json};

use crate::qaoa::QaoaRun;

/// Distinct bitstrings shown where `--json` is not given.
const SHOWN_SAMPLES: usize = 8;

/// What `--json` prints. Energies are in the units of the input; angles apply to the scaled problem.
pub(in crate::cli) fn document(run: &QaoaRun, time_ms: f64) -> Value {
    let samples: Map<String, Value> =
        run.samples.iter().map(|s| (s.bits.to_string(), json!(s.count))).collect();
    let best = run.best.as_ref().map(
        |best| json!({ "bits": best.bits.to_string(), "energy": best.energy, "count": best.count }),
    );
    let certificate = run.certificate.as_ref();
    let mut document = json!({
        "engine": run.engine.to_string(),
        "qubits": run.qubits,
        "layers": run.angles.layers(),
        "expectation": run.expectation,
        "objective": run.objective.to_string(),
        "loss_is_sampled": run.loss_is_sampled,
        "loss": run.loss,
        "gammas": run.angles.gammas(),
        "betas": run.angles.betas(),
        "best": best,
        "exact_optimum": certificate.map(|c| c.exact_optimum),
        "gap": certificate.and_then(|c| c.gap),
        "p_optimum": certificate.map(|c| c.p_optimum),
        "samples": samples,
        "time_ms": time_ms,
    });
    if let (Some(gradient), Some(document)) = (&run.gradient, document.as_object_mut()) {
        let gradient = json!({ "gammas": gradient.gammas(), "betas": gradient.betas() });
        document.insert("gradient".into(), gradient);
    }
    document
}

fn list(values: &[f64]) -> String {
    values.iter().map(|value| format!("{value:.4}")).collect::<Vec<_>>().join(", ")
}

/// What is printed without `--json`.
pub(in crate::cli) fn summary(run: &QaoaRun, time_ms: f64) -> String {
    let mut text = String::new();
    // Writing to a string does not fail.
    let mut line = |line: std::fmt::Arguments<'_>| {
        let _ = writeln!(text, "{line}");
    };
    let (layers, steps) = (run.angles.layers(), run.loss.len().saturating_sub(1));
    line(format_args!(
        "{} qubits, {layers} layers, {} engine, {time_ms:.1} ms",
        run.qubits, run.engine
    ));
    match run.loss.first() {
        Some(start) if steps > 0 => line(format_args!(
            "expectation   {:.6}  ({} from {start:.6} to {:.6} in {steps} Adam steps{})",
            run.expectation,
            run.objective,
            run.loss.iter().copied().fold(f64::INFINITY, f64::min),
            if run.loss_is_sampled { ", each from samples" } else { "" }
        )),
        _ => line(format_args!("expectation   {:.6}", run.expectation)),
    }
    line(format_args!("gammas        {}", list(run.angles.gammas())));
    line(format_args!("betas         {}", list(run.angles.betas())));
    if let Some(gradient) = &run.gradient {
        line(format_args!("d/d gammas    {}", list(gradient.gammas())));
        line(format_args!("d/d betas     {}", list(gradient.betas())));
    }
    if let Some(best) = &run.best {
        line(format_args!(
            "best sample   {:.6}  {}  ({} shots)",
            best.energy, best.bits, best.count
        ));
    }
    match &run.certificate {
        Some(certificate) => line(format_args!(
            "exact optimum {:.6}  (probability {:.3e} per shot{})",
            certificate.exact_optimum,
            certificate.p_optimum,
            certificate.gap.map(|gap| format!(", gap {gap:.3e}")).unwrap_or_default()
        )),
        None => line(format_args!(
            "exact optimum not known: too many qubits for a graph that is no chain"
        )),
    }
    let mut samples: Vec<_> = run.samples.iter().collect();
    samples.sort_by_key(|sample| std::cmp::Reverse(sample.count));
    for sample in samples.iter().take(SHOWN_SAMPLES) {
        line(format_args!("{:>13} x {}", sample.count, sample.bits));
    }
    if samples.len() > SHOWN_SAMPLES {
        line(format_args!("  and {} more; --json has all", samples.len() - SHOWN_SAMPLES));
    }
    text
}
