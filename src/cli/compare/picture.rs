//! Loss curves as a picture (the paper's figure "Cost function convergence", section "Loss
//! Analysis"): the first QAOA training of every scenario with QUAV's settings.
//!
//! Losses of different legs are metres of different paths. To fit one axis, each is drawn as its
//! height above the chain's exact optimum, as a share of that height before the training.

use svg::Document;
use svg::node::element::{Line, Polyline, Rectangle, Text};

use super::ScenarioResult;
use super::measure::Method;
use crate::report::json::leg::RoundDocument;

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 440.0;
const LEFT: f64 = 60.0;
const TOP: f64 = 40.0;
const RIGHT: f64 = 620.0;
const BOTTOM: f64 = 390.0;

/// Colours that stay apart for colour-blind readers (Okabe and Ito 2008).
const COLOURS: [&str; 7] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"];

/// The picture of all scenarios' curves, as SVG.
#[must_use]
pub fn loss_curves(scenarios: &[ScenarioResult]) -> String {
    let curves: Vec<(&str, Vec<f64>)> = scenarios
        .iter()
        .filter_map(|scenario| {
            let row = scenario.methods.iter().find(|row| row.method == Method::Quav)?;
            Some((scenario.name.as_str(), relative(row.rounds.first()?)?))
        })
        .collect();
    let steps = curves.iter().map(|(_, curve)| curve.len() - 1).max().unwrap_or(0).max(1);
    let most = curves.iter().flat_map(|(_, curve)| curve).copied().fold(1.0, f64::max);
    let x = |step: f64| LEFT + (RIGHT - LEFT) * step / steps as f64;
    let y = |share: f64| BOTTOM - (BOTTOM - TOP) * share / most;

    let mut picture = Document::new()
        .set("viewBox", (0.0, 0.0, WIDTH, HEIGHT))
        .set("font-family", "sans-serif")
        .set("font-size", 13)
        .add(
            Rectangle::new()
                .set("width", WIDTH)
                .set("height", HEIGHT)
                .set("fill", "#fff")
                .set("class", "plot"),
        )
        .add(label("QAOA loss above the exact optimum, first training", LEFT, TOP - 18.0, "start"))
        .add(label("Adam step", f64::midpoint(LEFT, RIGHT), HEIGHT - 12.0, "middle"));
    for tick in 0..=4 {
        let share = most * f64::from(tick) / 4.0;
        let step = steps as f64 * f64::from(tick) / 4.0;
        picture = picture
            .add(rule((LEFT, y(share)), (RIGHT, y(share))))
            .add(label(&format!("{:.0} %", share * 100.0), LEFT - 8.0, y(share) + 4.0, "end"))
            .add(label(&format!("{step:.0}"), x(step), BOTTOM + 20.0, "middle"));
    }
    for (k, (name, curve)) in curves.iter().enumerate() {
        let colour = COLOURS[k % COLOURS.len()];
        let points: Vec<String> = curve
            .iter()
            .enumerate()
            .map(|(step, &share)| format!("{:.1},{:.1}", x(step as f64), y(share)))
            .collect();
        picture = picture.add(
            Polyline::new()
                .set("points", points.join(" "))
                .set("fill", "none")
                .set("stroke", colour)
                .set("stroke-width", 2),
        );
        let row = TOP + 18.0 * k as f64;
        picture = picture.add(label(name, RIGHT + 14.0, row + 8.0, "start").set("fill", colour));
    }
    picture.to_string()
}

/// The heights of a loss curve above the optimum, as shares of the first; `None` where the optimum
/// is not known or there is nothing above it.
fn relative(round: &RoundDocument) -> Option<Vec<f64>> {
    let height = round.loss.first()? - round.exact_optimum;
    let usable = height.is_finite() && height > 0.0;
    usable.then(|| round.loss.iter().map(|loss| (loss - round.exact_optimum) / height).collect())
}

fn label(text: &str, x: f64, y: f64, anchor: &str) -> Text {
    let plain: String = text.chars().filter(|c| !c.is_control()).collect();
    Text::new(plain).set("x", x).set("y", y).set("text-anchor", anchor)
}

fn rule(from: (f64, f64), to: (f64, f64)) -> Line {
    Line::new()
        .set("x1", from.0)
        .set("y1", from.1)
        .set("x2", to.0)
        .set("y2", to.1)
        .set("stroke", "#ddd")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::compare::measure::Measured;
    use crate::planner::round::Challenger;

    fn scenario(name: &str, loss: &[f64]) -> ScenarioResult {
        let round = RoundDocument {
            challenger: Challenger::Route,
            engine: "chain".into(),
            window: None,
            objective: "mean".to_owned(),
            loss_is_sampled: false,
            qubits: 20,
            layers: 5,
            loss: loss.to_vec(),
            best_sample: 100.0,
            exact_optimum: 100.0,
            gap: 0.0,
            p_optimum: 0.1,
            penalty: 60.0,
            distinct: 7,
            length_m: 100.0,
            improved: true,
            qpu: None,
        };
        let quav = Measured {
            method: Method::Quav,
            runs: 1,
            found: 1,
            length_m: Some(100.0),
            min_clearance_m: Some(5.0),
            collisions: 0,
            time_ms: 1.0,
            iterations: 1.0,
            reason: None,
            rounds: vec![round],
        };
        let methods = vec![quav];
        let flown_over_or_under = Vec::new();
        let name = name.into();
        ScenarioResult {
            name,
            legs: 1,
            straight_m: 90.0,
            flown_over_or_under,
            methods,
            paper: None,
        }
    }

    /// The curves' points, as in the picture.
    fn curves(picture: &str) -> Vec<Vec<(f64, f64)>> {
        let point = |pair: &str| {
            let (x, y) = pair.split_once(',').unwrap();
            (x.parse().unwrap(), y.parse().unwrap())
        };
        let all = picture.split("<polyline").skip(1);
        all.map(|curve| curve.split("points=\"").nth(1).unwrap().split('"').next().unwrap())
            .map(|points| points.split(' ').map(point).collect())
            .collect()
    }

    #[test]
    fn a_curve_begins_at_the_top_left_and_ends_at_the_bottom_when_it_reaches_the_optimum() {
        let picture = loss_curves(&[scenario("s1", &[300.0, 200.0, 100.0])]);
        let middle = (f64::midpoint(LEFT, RIGHT), f64::midpoint(TOP, BOTTOM));
        assert_eq!(curves(&picture), [[(LEFT, TOP), middle, (RIGHT, BOTTOM)]]);
    }

    #[test]
    fn names_cannot_break_the_picture_and_a_training_without_a_fall_is_left_out() {
        let named = scenario("<a & \"b\">", &[300.0, 100.0]);
        let picture = loss_curves(&[named, scenario("flat", &[100.0, 100.0])]);
        assert_eq!(curves(&picture).len(), 1);
        let mut reader = quick_xml::Reader::from_str(&picture);
        while reader.read_event().unwrap() != quick_xml::events::Event::Eof {}
    }

    #[test]
    fn nothing_to_draw_is_an_empty_chart() {
        assert!(curves(&loss_curves(&[])).is_empty());
    }
}
