//! What a person reads on the terminal: plain text in lines of at most 80 columns.

use super::run::Run;
use super::stretch::stretches;
use super::text::{
    Table, best_gap, change, clearance, count, duration, finding, leg_label, named, push_wrapped,
    unbroken,
};
use crate::qaoa::qpu::QpuUse;
use crate::replan::{LegRecord, LegVerdict, Replanned, Verdict};
use crate::units::Metres;

/// The summary of a mission that was planned.
#[must_use]
pub fn plan_summary(result: &Replanned, run: &Run<'_>) -> String {
    let (before, after) = (&result.before, &result.after);
    let buffer = unbroken(run.options.settings.buffer);
    let legs = before.legs.len();
    let headline = if result.is_changed() {
        format!(
            "{} of {} re-planned with {}: the whole mission now keeps {buffer}.",
            result.legs.len(),
            count(legs, "leg"),
            count(result.inserted.len(), "new waypoint"),
        )
    } else {
        format!("Nothing to re-plan: the whole mission ({}) keeps {buffer}.", count(legs, "leg"))
    };
    let mut out = String::new();
    push_wrapped(&mut out, &headline, 0);

    out.push('\n');
    let mut table = Table::new(["", "before", "after", ""]);
    let rise = change(before.length(), after.length());
    let metres = |metres: Metres| metres.to_string();
    let places = |verdict: &Verdict| verdict.places().len().to_string();
    let yes_no = |yes: bool| if yes { "yes" } else { "no" }.to_owned();
    let none = String::new;
    table.row(["length".to_owned(), metres(before.length()), metres(after.length()), rise]);
    table.row([
        "least clearance".to_owned(),
        clearance(before.clearance()),
        clearance(after.clearance()),
        none(),
    ]);
    table.row(["waypoints".to_owned(), places(before), places(after), none()]);
    table.row([
        "free of collisions".to_owned(),
        yes_no(!before.collides()),
        yes_no(!after.collides()),
        none(),
    ]);
    table.push_to(&mut out);

    if result.is_changed() {
        out.push('\n');
        leg_table(result).push_to(&mut out);
    }
    let notes: Vec<String> = result.notes.iter().map(ToString::to_string).collect();
    heights(&mut out, before);
    if let Some(used) = &result.qpu {
        out.push('\n');
        push_wrapped(&mut out, &qpu_use(used), 4);
    }
    let fallback = result.fallback();
    remarks(&mut out, fallback, run, before.warnings.iter().chain(&notes));
    out
}

/// The legs that are flown over or under something.
fn heights(out: &mut String, verdict: &Verdict) {
    for (k, leg) in verdict.legs.iter().filter(|leg| !leg.passed.is_empty()).enumerate() {
        if k == 0 {
            out.push('\n');
        }
        let (name, named) = (leg.leg.name(), named(&leg.passed));
        let clear = format!("The {name} is clear of {named} by its altitude.");
        push_wrapped(out, &clear, 4);
    }
}

/// What was used of a QPU.
fn qpu_use(used: &QpuUse) -> String {
    let QpuUse { backend, jobs, picked_up, circuits, estimated_seconds, charged_seconds, .. } =
        used;
    let backend = if backend.is_empty() { "none" } else { backend };
    let picked = match picked_up {
        0 => String::new(),
        picked => format!(", {picked} of them paid for by an earlier run"),
    };
    format!(
        "QPU {backend}: {} with {}{picked}; {charged_seconds:.0} QPU seconds charged, at most \
         {estimated_seconds:.0} estimated before.",
        count(*jobs, "job"),
        count(*circuits, "circuit"),
    )
}

/// The re-planned legs.
fn leg_table(result: &Replanned) -> Table {
    let mut table =
        Table::new(["leg", "straight", "new", "detour", "clearance", "rounds", "best gap", "time"]);
    for stretch in stretches(result).iter().filter(|stretch| stretch.replanned) {
        let straight = stretch.before.length;
        let record = stretch.record;
        table.row([
            leg_label(&stretch.before.leg),
            format!("{straight:.1}"),
            format!("{:.1}", stretch.length),
            change(straight, stretch.length),
            clearance(stretch.clearance),
            record.map_or_else(|| "-".to_owned(), |record| record.rounds.len().to_string()),
            record.map_or_else(|| "-".to_owned(), |record| best_gap(&record.rounds)),
            record.map_or_else(|| "-".to_owned(), time),
        ]);
    }
    table
}

fn time(record: &LegRecord) -> String {
    let times = record.times;
    duration(times.candidates + times.qaoa + times.finish)
}

/// The summary of a judgement.
#[must_use]
pub fn check_summary(verdict: &Verdict, run: &Run<'_>) -> String {
    let buffer = unbroken(run.options.settings.buffer);
    let legs = verdict.legs.len();
    let too_near: Vec<&LegVerdict> = verdict.legs.iter().filter(|leg| !leg.is_clear()).collect();
    let collides = |leg: &&&LegVerdict| leg.collides();
    let colliding = too_near.iter().filter(collides).count();
    let mut out = String::new();
    let headline = if too_near.is_empty() {
        format!("Clear: the whole mission ({}) keeps {buffer}.", count(legs, "leg"))
    } else {
        let comes = if too_near.len() == 1 { "comes" } else { "come" };
        let collide = match colliding {
            0 => "none collides".to_owned(),
            1 => "1 collides".to_owned(),
            many => format!("{many} collide"),
        };
        format!(
            "Not clear: {} of {} {comes} nearer than {buffer} to an obstacle or the fence, and \
             {collide}.",
            too_near.len(),
            count(legs, "leg"),
        )
    };
    push_wrapped(&mut out, &headline, 0);
    out.push('\n');
    let mut table = Table::new(["", "mission"]);
    table.row(["length".to_owned(), verdict.length().to_string()]);
    table.row(["least clearance".to_owned(), clearance(verdict.clearance())]);
    table.row(["waypoints".to_owned(), verdict.places().len().to_string()]);
    table.push_to(&mut out);
    if !too_near.is_empty() {
        out.push('\n');
    }
    for leg in too_near {
        push_wrapped(&mut out, &finding(leg), 4);
    }
    heights(&mut out, verdict);
    remarks(&mut out, None, run, &verdict.warnings);
    out
}

/// The fallback and the warnings.
fn remarks<'a>(
    out: &mut String,
    fallback: Option<String>,
    run: &Run<'a>,
    warnings: impl IntoIterator<Item = &'a String>,
) {
    let mut remarks = Vec::new();
    let rules = &run.options.rules;
    remarks.extend(rules.applied.iter().map(|text| format!("vehicle fence: {text}")));
    remarks.extend(rules.missing.iter().map(|text| format!("warning: vehicle fence: {text}")));
    remarks.extend(fallback.map(|fallback| format!("fallback: {fallback}")));
    remarks.extend(run.warnings.iter().chain(warnings).map(|text| format!("warning: {text}")));
    if !remarks.is_empty() {
        out.push('\n');
    }
    for remark in remarks {
        push_wrapped(out, &remark, 4);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::replan::Options;
    use crate::report::samples::{self, BARN, POND, YARD};
    use crate::report::text::WIDTH;

    fn fits(text: &str) {
        for line in text.lines() {
            assert!(line.chars().count() <= WIDTH, "{line}");
            assert!(!line.chars().any(char::is_control), "{line:?}");
        }
    }

    #[test]
    fn a_plan_is_told_with_its_figures_before_and_after() {
        let options = Options::default();
        let result = samples::planned(POND, &options);
        let text = plan_summary(&result, &samples::run(&options, &[]));
        fits(&text);
        assert!(text.starts_with("2 of 4 legs re-planned with "), "{text}");
        let row = |head: &str| text.lines().find(|line| line.starts_with(head)).unwrap();
        let lengths = [result.before.length(), result.after.length()].map(|m| m.to_string());
        assert!(lengths.iter().all(|length| row("length").contains(length)), "{text}");
        assert!(row("least clearance").contains("0.00 m"), "{text}");
        assert!(row("free of collisions").ends_with("yes"), "{text}");
        let places = [&result.before, &result.after].map(|v| v.places().len().to_string());
        assert!(row("waypoints").ends_with(&places[1]) && row("waypoints").contains(&places[0]));
        assert!(text.lines().any(|line| line.starts_with("1 - 2 ")), "{text}");
        assert!(text.lines().any(|line| line.starts_with("3 - 4 ")), "{text}");
    }

    #[test]
    fn a_mission_that_needs_nothing_says_so_and_has_no_clearance_without_regions() {
        let options = Options::default();
        let result = samples::planned_without_fences(BARN, &options);
        let text = plan_summary(&result, &samples::run(&options, &[]));
        fits(&text);
        assert!(text.starts_with("Nothing to re-plan"), "{text}");
        assert!(!text.contains("inf"), "{text}");
    }

    #[test]
    fn fallback_and_warnings_fit_whatever_they_hold() {
        let options = Options::default();
        let mut result = samples::planned(BARN, &options);
        result.legs.iter_mut().for_each(|record| record.cut_short = true);
        let warnings =
            [format!("a file called {} is\todd\u{1b}[31m", "long".repeat(60)), "short".to_owned()];
        let text = plan_summary(&result, &samples::run(&options, &warnings));
        fits(&text);
        assert!(text.contains("fallback: the deadline passed: the leg from item"), "{text}");
        assert!(text.contains("warning: short"), "{text}");
    }

    #[test]
    fn a_judgement_says_which_legs_are_not_clear_and_why() {
        let options = Options::default();
        let (verdict, _) = samples::judged(YARD, &options);
        let text = check_summary(&verdict, &samples::run(&options, &[]));
        fits(&text);
        assert!(text.starts_with("Not clear: 2 of 2 legs come nearer than 5.00 m"), "{text}");
        let joined = text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(joined.contains("and 2 collide."), "{text}");
        assert!(joined.contains("The leg from item 1 to item 2 meets sample.plan"), "{text}");
    }

    #[test]
    fn a_clear_mission_is_judged_clear() {
        let options = Options::default();
        let after = samples::planned(BARN, &options).after;
        let text = check_summary(&after, &samples::run(&options, &[]));
        fits(&text);
        assert!(text.starts_with("Clear: the whole mission (5 legs) keeps 5.00 m."), "{text}");
    }
}
