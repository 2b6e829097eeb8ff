//! The options that give the same plan again.

use crate::planner::CandidateSource;
use crate::replan::Options;
use crate::report::json::SettingsDocument;

/// The options of the command line for these settings, each with a space before it.
pub(crate) fn arguments(options: &Options) -> String {
    let SettingsDocument {
        buffer,
        qubits,
        layers,
        steps,
        learning_rate,
        shots,
        rounds,
        seed,
        grid,
        source,
        lambda,
        engine,
        full_training,
        zone,
        inclusion,
        deadline,
        ..
    } = SettingsDocument::from(options);
    let deadline = deadline.map_or_else(String::new, |time| format!(" --deadline {time}"));
    let common = format!(
        " --shots {shots} --rounds {rounds} --seed {seed} --lambda {} --engine {engine} --zone {zone} \
         --inclusion {inclusion}{deadline}",
        lambda.0
    );
    // Only --paper trains every round in full.
    if full_training {
        return format!(" --paper{common}");
    }
    let source = match source {
        CandidateSource::Corners => "corners",
        CandidateSource::Grid => "grid",
        CandidateSource::Both => "both",
    };
    format!(
        " --buffer {} --qubits {qubits} --layers {layers} --steps {steps} --learning-rate \
         {learning_rate} --grid {} --candidates {source}{common}",
        buffer.0, grid.0
    )
}
