//! Axes with round numbers, and curves between them.

use svg::node::element::{Group, Line};

use super::text;
use super::view::{Rect, px};

/// One axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Axis {
    low: f64,
    high: f64,
    log: bool,
}

impl Axis {
    /// A linear axis over some values, with a little room.
    pub(super) fn linear(low: f64, high: f64) -> Self {
        let room = if high > low { 0.0 } else { 0.5 };
        Self { low: low - room, high: high + room, log: false }
    }

    /// A logarithmic axis over whole decades, at most `decades` down from the highest value.
    pub(super) fn decades(low: f64, high: f64, decades: i32) -> Self {
        let top = high.max(f64::MIN_POSITIVE).log10().ceil();
        let bottom = low.max(f64::MIN_POSITIVE).log10().floor();
        let bottom = bottom.max(top - f64::from(decades)).min(top - 1.0);
        Self { low: 10f64.powf(bottom), high: 10f64.powf(top), log: true }
    }

    /// Where a value is, from 0 at the low end to 1; values beyond an end are at the end.
    fn share(&self, value: f64) -> f64 {
        let share = if self.log {
            (value.max(self.low) / self.low).log10() / (self.high / self.low).log10()
        } else {
            (value - self.low) / (self.high - self.low)
        };
        share.clamp(0.0, 1.0)
    }

    /// Round values to be marked, with what is written there.
    fn ticks(&self, about: f64) -> Vec<(f64, String)> {
        if self.log {
            let (low, high) = (self.low.log10().round() as i32, self.high.log10().round() as i32);
            let step = ((f64::from(high - low) / about).ceil() as usize).max(1);
            let label = |decade: i32| {
                let value = 10f64.powi(decade);
                if (-3..=6).contains(&decade) { format!("{value}") } else { format!("{value:e}") }
            };
            return (low..=high).step_by(step).map(|k| (10f64.powi(k), label(k))).collect();
        }
        let rough = (self.high - self.low) / about;
        let decade = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0]
            .map(|m| m * decade)
            .into_iter()
            .find(|s| *s >= rough)
            .unwrap_or(10.0 * decade);
        let decimals = (-step.log10().floor()).max(0.0) as usize;
        let first = (self.low / step).ceil() as i64;
        let last = (self.high / step + 1e-9).floor() as i64;
        (first..=last)
            .map(|k| k as f64 * step)
            .map(|value| (value, format!("{value:.decimals$}")))
            .collect()
    }
}

/// A chart with its axes drawn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chart {
    area: Rect,
    x: Axis,
    y: Axis,
}

impl Chart {
    /// A chart in a rectangle that also has room for title and labels.
    pub(super) fn new(rect: Rect, x: Axis, y: Axis) -> Self {
        let area = Rect {
            x: rect.x + 44.0,
            y: rect.y + 30.0,
            width: rect.width - 44.0,
            height: rect.height - 30.0 - 38.0,
        };
        Self { area, x, y }
    }

    /// The plotting area.
    pub(super) fn area(&self) -> Rect {
        self.area
    }

    /// Title, axes and their labels.
    pub(super) fn axes(&self, title: &str, x_label: &str) -> Group {
        let Rect { x, y, width, height } = self.area;
        let mut group = Group::new().add(text(x - 44.0, y - 14.0, "head", title));
        for (value, label) in self.y.ticks(5.0) {
            let at = self.y_at(value);
            group = group.add(line(x, at, x + width, at, "tick")).add(text(
                x - 6.0,
                at + 4.0,
                "small end",
                &label,
            ));
        }
        for (value, label) in self.x.ticks(7.0) {
            let at = self.x_at(value);
            group = group.add(line(at, y + height, at, y + height + 4.0, "axis")).add(text(
                at,
                y + height + 17.0,
                "small middle",
                &label,
            ));
        }
        group
            .add(line(x, y, x, y + height, "axis"))
            .add(line(x, y + height, x + width, y + height, "axis"))
            .add(text(x + width / 2.0, y + height + 34.0, "small middle", x_label))
    }

    fn x_at(&self, value: f64) -> f64 {
        self.area.x + self.area.width * self.x.share(value)
    }

    fn y_at(&self, value: f64) -> f64 {
        self.area.y + self.area.height * (1.0 - self.y.share(value))
    }

    /// Path data of a curve; values that are not finite are left out.
    pub(super) fn curve(&self, points: impl IntoIterator<Item = (f64, f64)>) -> String {
        let points = points.into_iter().filter(|(x, y)| x.is_finite() && y.is_finite());
        let mut data = String::new();
        for (x, y) in points {
            data.push(if data.is_empty() { 'M' } else { 'L' });
            data += &format!("{} {}", px(self.x_at(x)), px(self.y_at(y)));
        }
        data
    }
}

fn line(x1: f64, y1: f64, x2: f64, y2: f64, class: &str) -> Line {
    Line::new()
        .set("x1", px(x1))
        .set("y1", px(y1))
        .set("x2", px(x2))
        .set("y2", px(y2))
        .set("class", class)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_axis_is_marked_at_round_numbers_within_it() {
        let ticks = Axis::linear(6.83, 7.41).ticks(5.0);
        let labels: Vec<&str> = ticks.iter().map(|(_, label)| label.as_str()).collect();
        assert_eq!(labels, ["7.0", "7.2", "7.4"]);
    }

    #[test]
    fn a_logarithmic_axis_has_whole_decades_even_for_equal_or_vanishing_values() {
        for axis in [Axis::decades(3.0, 3.0, 5), Axis::decades(0.0, 0.0, 5)] {
            assert!(axis.low > 0.0 || axis.high > axis.low, "{axis:?}");
            assert!(!axis.ticks(5.0).is_empty());
        }
        let axis = Axis::decades(1e-9, 700.0, 4);
        assert!((axis.low - 0.1).abs() < 1e-9 && (axis.high - 1000.0).abs() < 1e-6);
        assert_eq!(axis.share(1e-12), 0.0);
    }
}
