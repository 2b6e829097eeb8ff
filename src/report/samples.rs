//! Planned and judged missions for the tests of the reports, from `fence_examples`.

use std::time::Duration;

use super::Run;
use crate::formats::{Scenario, read_scenario};
use crate::geodesy::LatLon;
use crate::qaoa::qpu::Qpu;
use crate::replan::{
    Field, Input, Options, ReplanError, Replanned, Verdict, fields, judge, replan, replan_with,
};
use crate::stop::Stop;

/// A field to stay inside with a pond; two legs go through the pond.
pub(crate) const POND: &str = include_str!("../../fence_examples/inclusion-with-hole.plan");

/// A barn in the way of the first leg; the last leg is a return home.
pub(crate) const BARN: &str = include_str!("../../fence_examples/one-polygon.plan");

/// A goal in a walled yard.
pub(crate) const YARD: &str = include_str!("../../fence_examples/infeasible.plan");

fn scenario(plan: &str) -> Scenario {
    read_scenario("sample.plan", plan.as_bytes()).unwrap()
}

fn with_input<T>(scenario: &Scenario, use_it: impl FnOnce(&Input<'_>) -> T) -> T {
    let rally: Vec<LatLon> = scenario.rally.iter().map(|item| item.position().unwrap()).collect();
    let (mission, fences) = (&scenario.mission, &scenario.fences);
    let (start, autopilot) = (None, scenario.vehicle.autopilot);
    use_it(&Input { mission, fences, rally: &rally, start, autopilot })
}

pub(crate) fn planned(plan: &str, options: &Options) -> Replanned {
    with_input(&scenario(plan), |input| replan(input, options, &Stop::new(), |_| {}).unwrap())
}

/// The same on a QPU.
pub(crate) fn planned_on(
    plan: &str,
    options: &Options,
    qpu: Option<&mut dyn Qpu>,
) -> Result<Replanned, ReplanError> {
    with_input(&scenario(plan), |input| replan_with(input, options, qpu, &Stop::new(), |_| {}))
}

/// The same mission without its fences: nothing to keep away from.
pub(crate) fn planned_without_fences(plan: &str, options: &Options) -> Replanned {
    let scenario = Scenario { fences: Default::default(), ..scenario(plan) };
    with_input(&scenario, |input| replan(input, options, &Stop::new(), |_| {}).unwrap())
}

/// The barn in the way out and in the way back, which may end at home or at a rally point 30 m
/// from there.
pub(crate) fn planned_there_and_back(options: &Options) -> Replanned {
    let mut scenario = scenario(BARN);
    scenario.mission.items.remove(2);
    scenario.mission.items[2].seq = 2;
    let home = scenario.mission.home.unwrap().position;
    let rally = [LatLon::new(home.lat(), home.lon() - 4e-4).unwrap()];
    with_input(&scenario, |input| {
        let input = Input { rally: &rally, ..*input };
        replan(&input, options, &Stop::new(), |_| {}).unwrap()
    })
}

pub(crate) fn judged(plan: &str, options: &Options) -> (Verdict, Vec<Field>) {
    with_input(&scenario(plan), |input| {
        (judge(input, options).unwrap(), fields(input, options).unwrap())
    })
}

pub(crate) fn run<'a>(options: &'a Options, warnings: &'a [String]) -> Run<'a> {
    let (load, total) = (Duration::from_micros(1234), Duration::from_millis(98));
    Run { options, warnings, load, total }
}
