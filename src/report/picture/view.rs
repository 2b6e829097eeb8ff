//! From local metres to the page: places, rings, and numbers with one decimal.

use std::fmt::Write as _;

use crate::geodesy::Xy;

/// Points of a ring nearer to each other than this on the page are drawn as one, pixels.
const DETAIL: f64 = 0.3;

/// A rectangle on the page, pixels, y downwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rect {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

impl Rect {
    pub(super) fn right(self) -> f64 {
        self.x + self.width
    }

    pub(super) fn bottom(self) -> f64 {
        self.y + self.height
    }

    pub(super) fn contains(self, x: f64, y: f64) -> bool {
        (self.x..=self.right()).contains(&x) && (self.y..=self.bottom()).contains(&y)
    }

    pub(super) fn overlaps(self, other: Self) -> bool {
        self.x < other.right()
            && other.x < self.right()
            && self.y < other.bottom()
            && other.y < self.bottom()
    }

    /// Whether a line meets the rectangle (Liang and Barsky 1984).
    pub(super) fn meets(self, a: Xy, b: Xy) -> bool {
        let (mut enters, mut leaves) = (0.0f64, 1.0f64);
        let (dx, dy) = (b.x - a.x, b.y - a.y);
        for (along, room) in [
            (-dx, a.x - self.x),
            (dx, self.right() - a.x),
            (-dy, a.y - self.y),
            (dy, self.bottom() - a.y),
        ] {
            if along == 0.0 {
                if room < 0.0 {
                    return false;
                }
            } else if along < 0.0 {
                enters = enters.max(room / along);
            } else {
                leaves = leaves.min(room / along);
            }
        }
        enters <= leaves
    }

    /// The rectangle as an SVG element.
    pub(super) fn element(self) -> svg::node::element::Rectangle {
        svg::node::element::Rectangle::new()
            .set("x", px(self.x))
            .set("y", px(self.y))
            .set("width", px(self.width))
            .set("height", px(self.height))
    }
}

/// A pixel coordinate with at most one decimal.
pub(super) fn px(value: f64) -> String {
    // + 0.0: no "-0".
    let tenths = (value * 10.0).round() / 10.0 + 0.0;
    format!("{tenths}")
}

/// Local metres drawn to scale in a panel of the page, grid north up.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    pub(super) panel: Rect,
    centre: Xy,
    /// Pixels per metre.
    pub(super) scale: f64,
}

impl View {
    /// A view that shows everything between two corners, and what is around it where the panel
    /// has room.
    pub(super) fn new(panel: Rect, low: Xy, high: Xy) -> Self {
        let scale = (panel.width / (high.x - low.x)).min(panel.height / (high.y - low.y));
        Self { panel, centre: (low + high) / 2.0, scale }
    }

    /// The same view in a panel around the same middle.
    pub(super) fn within(self, panel: Rect) -> Self {
        Self { panel, ..self }
    }

    /// A point on the page.
    pub(super) fn at(&self, point: Xy) -> Xy {
        let offset = (point - self.centre) * self.scale;
        Xy {
            x: self.panel.x + self.panel.width / 2.0 + offset.x,
            y: self.panel.y + self.panel.height / 2.0 - offset.y,
        }
    }

    /// Whether any of the points' bounding box, grown by some metres, is in the panel.
    pub(super) fn shows<'a>(&self, points: impl IntoIterator<Item = &'a Xy>, grown: f64) -> bool {
        let far = f64::INFINITY;
        let (mut low, mut high) = (Xy { x: far, y: far }, Xy { x: -far, y: -far });
        for &point in points {
            let at = self.at(point);
            low = Xy { x: low.x.min(at.x), y: low.y.min(at.y) };
            high = Xy { x: high.x.max(at.x), y: high.y.max(at.y) };
        }
        let grown = grown * self.scale;
        let (width, height) = (high.x - low.x + 2.0 * grown, high.y - low.y + 2.0 * grown);
        Rect { x: low.x - grown, y: low.y - grown, width, height }.overlaps(self.panel)
    }

    /// Path data of a line through some points.
    pub(super) fn line<'a>(&self, points: impl IntoIterator<Item = &'a Xy>) -> String {
        let mut data = String::new();
        let mut last: Option<Xy> = None;
        let mut skipped = None;
        for &point in points {
            let at = self.at(point);
            match last {
                None => push(&mut data, 'M', at),
                Some(last) if (at.x - last.x).hypot(at.y - last.y) < DETAIL => {
                    skipped = Some(at);
                    continue;
                }
                Some(_) => push(&mut data, 'L', at),
            }
            (last, skipped) = (Some(at), None);
        }
        if let Some(end) = skipped {
            push(&mut data, 'L', end);
        }
        data
    }

    /// Path data of a ring.
    pub(super) fn ring<'a>(&self, points: impl IntoIterator<Item = &'a Xy>) -> String {
        self.line(points) + "Z"
    }

    /// Path data of a full circle.
    pub(super) fn circle(&self, centre: Xy, radius: f64) -> String {
        let (at, r) = (self.at(centre), radius * self.scale);
        let (left, right, y, r) = (px(at.x - r), px(at.x + r), px(at.y), px(r));
        format!("M{left} {y}A{r} {r} 0 1 0 {right} {y}A{r} {r} 0 1 0 {left} {y}Z")
    }
}

fn push(data: &mut String, command: char, at: Xy) {
    // Writing to a string does not fail.
    let _ = write!(data, "{command}{} {}", px(at.x), px(at.y));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, y: f64) -> Xy {
        Xy { x, y }
    }

    #[test]
    fn a_line_meets_a_rectangle_or_passes_it() {
        let rect = Rect { x: 0.0, y: 0.0, width: 10.0, height: 4.0 };
        assert!(rect.meets(at(-5.0, 2.0), at(15.0, 3.0)));
        assert!(rect.meets(at(5.0, 1.0), at(6.0, 2.0)));
        assert!(!rect.meets(at(-5.0, 5.0), at(15.0, 5.0)));
        assert!(!rect.meets(at(-5.0, 2.0), at(-1.0, 2.0)));
    }

    #[test]
    fn a_view_keeps_proportions_and_has_north_up() {
        let panel = Rect { x: 10.0, y: 20.0, width: 400.0, height: 100.0 };
        let view = View::new(panel, at(-50.0, -50.0), at(50.0, 50.0));
        assert_eq!(view.scale, 1.0);
        assert_eq!(view.at(at(0.0, 50.0)), at(210.0, 20.0));
        assert_eq!(view.at(at(50.0, -50.0)), at(260.0, 120.0));
    }

    #[test]
    fn points_that_look_the_same_are_drawn_once_and_the_last_one_is_kept() {
        let panel = Rect { x: 0.0, y: 0.0, width: 100.0, height: 100.0 };
        let view = View::new(panel, at(-50.0, -50.0), at(50.0, 50.0));
        let line = [at(0.0, 0.0), at(0.01, 0.0), at(10.0, 0.0), at(10.2, 0.0)];
        assert_eq!(view.line(&line), "M50 50L60 50L60.2 50");
        assert_eq!(view.line([]), "");
    }

    #[test]
    fn what_lies_beside_the_panel_is_not_shown_unless_its_buffer_reaches_it() {
        let panel = Rect { x: 0.0, y: 0.0, width: 100.0, height: 100.0 };
        let view = View::new(panel, at(-50.0, -50.0), at(50.0, 50.0));
        let beside = [at(53.0, 0.0), at(60.0, 5.0)];
        assert!(!view.shows(&beside, 0.0));
        assert!(view.shows(&beside, 5.0));
    }

    #[test]
    fn numbers_have_one_decimal_at_most_and_no_negative_zero() {
        assert_eq!([px(12.04), px(-0.01), px(3.25001)], ["12", "0", "3.3"]);
    }
}
