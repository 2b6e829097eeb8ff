//! Whether two paths with the same ends pass obstacles on different sides (are not homotopic).

use super::leg_space::LegSpace;
use crate::airspace::outline::edges;
use crate::geodesy::Xy;

/// Whether any obstacle lies between two paths that share their ends: one passes it on the left
/// and the other on the right. Of colliding paths any answer may come.
#[must_use]
pub fn passes_differently(one: &[Xy], other: &[Xy], space: &LegSpace<'_>) -> bool {
    let round: Vec<Xy> = one.iter().chain(other.iter().rev()).copied().collect();
    let (mut low, mut high) = match round.first() {
        Some(&first) => (first, first),
        None => return false,
    };
    for point in &round {
        low = Xy { x: low.x.min(point.x), y: low.y.min(point.y) };
        high = Xy { x: high.x.max(point.x), y: high.y.max(point.y) };
    }
    // No clear path crosses an obstacle, so each is between them as a whole or not at all.
    space.airspace().obstacles_in(low, high).any(|(_, inside)| winding(&round, inside) != 0)
}

/// How many times a closed line goes round a point, counter-clockwise.
fn winding(round: &[Xy], point: Xy) -> i32 {
    edges(round).fold(0, |turns, (a, b)| {
        let left = (b.x - a.x) * (point.y - a.y) - (b.y - a.y) * (point.x - a.x);
        match (a.y <= point.y, b.y <= point.y) {
            (true, false) if left > 0.0 => turns + 1,
            (false, true) if left < 0.0 => turns - 1,
            _ => turns,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_closed_line_winds_around_what_it_encloses() {
        let square = [(0., 0.), (4., 0.), (4., 4.), (0., 4.)].map(|(x, y)| Xy { x, y });
        assert_eq!(winding(&square, Xy { x: 1., y: 2. }), 1);
        assert_eq!(winding(&square, Xy { x: 5., y: 2. }), 0);
        let back: Vec<Xy> = square.iter().rev().copied().collect();
        assert_eq!(winding(&back, Xy { x: 1., y: 2. }), -1);
        let eight = [(0., 0.), (4., 4.), (4., 0.), (0., 4.)].map(|(x, y)| Xy { x, y });
        assert_eq!(winding(&eight, Xy { x: 0.5, y: 2. }).abs(), 1);
    }
}
