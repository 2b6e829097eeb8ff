//! A ring's edges by their height, so that the side of a point is told from the few edges at its
//! own height instead of from all of them.

use super::outline::{crosses_ahead, edges};
use crate::geodesy::Xy;

/// Rings with fewer vertices are as quick without.
const WORTH_IT: usize = 24;

/// The edges of one ring in horizontal slabs.
#[derive(Debug)]
pub(super) struct Slabs {
    low: f64,
    height: f64,
    /// The edges of slab `k` are `edges[starts[k]..starts[k + 1]]`.
    starts: Vec<usize>,
    edges: Vec<(Xy, Xy)>,
}

impl Slabs {
    /// The slabs of a ring that is not closed; `None` where they bring nothing.
    pub(super) fn of(ring: &[Xy]) -> Option<Self> {
        if ring.len() < WORTH_IT {
            return None;
        }
        let low = ring.iter().map(|point| point.y).fold(f64::INFINITY, f64::min);
        let high = ring.iter().map(|point| point.y).fold(f64::NEG_INFINITY, f64::max);
        // As high as a mean edge: an edge is in two slabs, or in few more, on average.
        let height = edges(ring).map(|(a, b)| (b.y - a.y).abs()).sum::<f64>() / ring.len() as f64;
        if !(height > 0.0 && height.is_finite()) {
            return None;
        }
        let mut slabs: Vec<Vec<(Xy, Xy)>> = vec![Vec::new(); ((high - low) / height) as usize + 1];
        let last = slabs.len() - 1;
        for (a, b) in edges(ring) {
            let slab = |y: f64| (((y - low) / height) as usize).min(last);
            for slab in &mut slabs[slab(a.y.min(b.y))..=slab(a.y.max(b.y))] {
                slab.push((a, b));
            }
        }
        let mut starts = vec![0];
        for slab in &slabs {
            starts.push(starts[starts.len() - 1] + slab.len());
        }
        Some(Self { low, height, starts, edges: slabs.concat() })
    }

    /// The same as [`super::outline::contains`].
    pub(super) fn contain(&self, point: Xy) -> bool {
        let slab = (point.y - self.low) / self.height;
        let last = self.starts.len() - 2;
        if slab < 0.0 || slab >= (last + 1) as f64 {
            return false;
        }
        let slab = slab as usize;
        self.edges[self.starts[slab]..self.starts[slab + 1]]
            .iter()
            .fold(false, |inside, &(a, b)| inside != crosses_ahead(a, b, point))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::outline::contains;
    use super::*;

    proptest! {
        #[test]
        fn a_side_told_from_slabs_is_that_told_from_all_edges(
            ring in prop::collection::vec((-9.0f64..9.0, -9.0f64..9.0), WORTH_IT..60),
            points in prop::collection::vec((-10.0f64..10.0, -10.0f64..10.0), 20),
        ) {
            let ring: Vec<Xy> = ring.into_iter().map(|(x, y)| Xy { x, y }).collect();
            let slabs = Slabs::of(&ring).unwrap();
            // The heights of vertices are where edges begin and end.
            let at_vertices = ring.iter().map(|vertex| (0.1, vertex.y));
            for (x, y) in points.into_iter().chain(at_vertices) {
                let point = Xy { x, y };
                prop_assert_eq!(slabs.contain(point), contains(&ring, point));
            }
        }
    }

    #[test]
    fn a_flat_ring_has_no_slabs() {
        let flat: Vec<Xy> = (0..100).map(|k| Xy { x: f64::from(k), y: 1.0 }).collect();
        assert!(Slabs::of(&flat).is_none());
    }
}
