use super::*;
use crate::fence::FenceSet;
use crate::formats::read_scenario;
use crate::replan::Options;
use crate::report::samples::{self, BARN, POND, YARD};

fn fences(plan: &str) -> FenceSet {
    read_scenario("sample.plan", plan.as_bytes()).unwrap().fences
}

fn planned_page(plan: &str, title: &str) -> String {
    let options = Options::default();
    let result = samples::planned(plan, &options);
    let fences = fences(plan);
    let run = samples::run(&options, &[]);
    let report = Report::planned(&result, run, title, &fences);
    page(&Report { command: Some("plan sample.plan"), ..report }).unwrap()
}

#[test]
fn a_page_holds_map_table_curves_rounds_settings_and_the_command() {
    let page = planned_page(POND, "the pond");
    for part in [
        "<h1>the pond</h1>",
        "id=\"map\"",
        "class=\"buffer\"",
        "class=\"incumbent\"",
        "QAOA training: expected cost above the exact optimum",
        "<caption>Legs of the mission",
        "gap to optimum",
        "id=\"round\"",
        "quavd plan sample.plan --buffer 5 ",
        " --seed 0",
        "\"min_clearance_m\"",
        "Free of collisions",
    ] {
        assert!(page.contains(part), "{part}");
    }
    // Each obstacle says its name, each waypoint its number and clearance.
    assert!(page.contains("data-tip=\"sample.plan geoFence polygon 2\""));
    assert!(page.contains("inserted; the leg to it keeps 5."));
}

#[test]
fn nothing_in_a_page_is_loaded_from_elsewhere() {
    let page = planned_page(BARN, "barn");
    let links = page.match_indices("http").map(|(at, _)| &page[at..page.len().min(at + 40)]);
    let foreign: Vec<_> = links
        .filter(|link| !link.starts_with("http://www.w3.org/") && !link.starts_with("http-equiv"))
        .collect();
    assert!(foreign.is_empty(), "{foreign:?}");
    assert!(!page.contains("src="));
}

#[test]
fn names_from_outside_stay_text() {
    let title = "</script><img src=x onerror=alert(1)>\"'&\u{0}";
    let page = planned_page(BARN, title);
    assert!(!page.contains("<img"));
    assert_eq!(page.matches("<script").count(), page.matches("</script>").count());
}

#[test]
fn a_mission_without_a_plan_says_why_and_what_is_in_the_way() {
    let options = Options::default();
    let (verdict, fields) = samples::judged(YARD, &options);
    let (run, fences) = (samples::run(&options, &[]), fences(YARD));
    let report = Report::judged(&verdict, &fields, run, "yard", &fences);
    let page = page(&Report { reason: Some("shut in by the wall"), ..report }).unwrap();
    assert!(page.contains("There is no plan: shut in by the wall"));
    assert!(page.contains("The leg from item 1 to item 2 meets"));
    assert!(!page.contains("id=\"round\""));
}

#[test]
fn a_page_without_fences_or_items_is_a_page() {
    let options = Options::default();
    let nothing = Verdict { legs: Vec::new(), warnings: Vec::new() };
    let fences = FenceSet::default();
    let report = Report::judged(&nothing, &[], samples::run(&options, &[]), "", &fences);
    assert!(page(&report).unwrap().contains("nothing to change"));
    let result = samples::planned_without_fences(BARN, &options);
    let report = Report::planned(&result, samples::run(&options, &[]), "", &fences);
    assert!(page(&report).unwrap().contains("nothing to change"));
}
