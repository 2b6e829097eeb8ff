//! What a person reads on the terminal: plain text in lines of at most 80 columns.

use super::run::Run;
use super::stretch::stretches;
use super::text::{Table, change, clearance, count, duration, leg_label, push_wrapped, unbroken};
use crate::planner::rounds::Round;
use crate::replan::{LegRecord, Replanned, Verdict};
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
    remarks(&mut out, run, before.warnings.iter().chain(&notes));
    out
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

/// How near the best sample of any round came to the exact optimum of its chain.
fn best_gap(rounds: &[Round]) -> String {
    let gaps = rounds.iter().map(|round| round.gap).filter(|gap| gap.is_finite());
    match gaps.reduce(f64::min) {
        None => "-".to_owned(),
        Some(gap) => format!("{:.2} m", (gap - 1e-9).max(0.0)),
    }
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
    let too_near: Vec<_> =
        verdict.legs.iter().filter_map(|leg| Some((leg, leg.blocker.as_ref()?))).collect();
    let colliding = too_near.iter().filter(|(_, (_, meets))| *meets).count();
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
    for (leg, (region, meets)) in too_near {
        let what = if *meets {
            format!("meets {region}")
        } else {
            format!("comes within {} of {region}", clearance(leg.clearance))
        };
        push_wrapped(&mut out, &format!("The {} {what}.", leg.leg.name()), 4);
    }
    remarks(&mut out, run, &verdict.warnings);
    out
}

/// The fallback and the warnings.
fn remarks<'a>(out: &mut String, run: &Run<'a>, warnings: impl IntoIterator<Item = &'a String>) {
    let mut remarks = Vec::new();
    remarks.extend(run.fallback.map(|fallback| format!("fallback: {fallback}")));
    remarks.extend(run.warnings.iter().chain(warnings).map(|text| format!("warning: {text}")));
    if !remarks.is_empty() {
        out.push('\n');
    }
    for remark in remarks {
        push_wrapped(out, &remark, 4);
    }
}
