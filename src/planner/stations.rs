//! Path segmentation (paper, "Path Segmentation"): a polyline cut into `N` edges.
//!
//! The paper steps along the straight line by `D / N`. A candidate with corners keeps these as
//! stations, each near the place in the sequence that its distance along the path calls for, so
//! that stations with the same index on two candidates are about as far on the way.

use super::polyline::distance;
use crate::geodesy::Xy;

/// The `edges + 1` stations of a polyline: its vertices, and points between them so that the
/// edges are of about equal length. `None` where it has more edges than asked for.
#[must_use]
pub fn stations(path: &[Xy], edges: usize) -> Option<Vec<Xy>> {
    let segments = path.len().checked_sub(1)?;
    if segments == 0 || segments > edges {
        return None;
    }
    let mut along = vec![0.0];
    for edge in path.windows(2) {
        along.push(along[along.len() - 1] + distance(edge[0], edge[1]));
    }
    let total = along[segments];
    // Where each vertex goes: as near as possible to its share of the way, in order, with room
    // for those before and after it.
    let mut places = vec![0usize; segments + 1];
    for k in 1..=segments {
        let share = if total > 0.0 { along[k] / total * edges as f64 } else { k as f64 };
        let room = edges - (segments - k);
        places[k] = (share.round() as usize).clamp(places[k - 1] + 1, room);
    }
    let mut result = Vec::with_capacity(edges + 1);
    for (k, edge) in path.windows(2).enumerate() {
        let pieces = places[k + 1] - places[k];
        for piece in 0..pieces {
            result.push(edge[0] + (edge[1] - edge[0]) * (piece as f64 / pieces as f64));
        }
    }
    result.push(path[segments]);
    Some(result)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_straight_line_is_cut_into_steps_of_the_papers_length() {
        let line = [Xy { x: 0., y: 0. }, Xy { x: 100., y: 0. }];
        let cut = stations(&line, 20).unwrap();
        assert_eq!(cut.len(), 21);
        for (i, station) in cut.iter().enumerate() {
            assert!((station.x - 5.0 * i as f64).abs() < 1e-9);
        }
    }

    proptest! {
        #[test]
        fn every_vertex_is_a_station_in_order(
            path in prop::collection::vec((-50.0f64..50.0, -50.0f64..50.0), 2..12), edges in 1usize..30,
        ) {
            let path: Vec<Xy> = path.into_iter().map(|(x, y)| Xy { x, y }).collect();
            match stations(&path, edges) {
                None => prop_assert!(path.len() - 1 > edges),
                Some(cut) => {
                    prop_assert_eq!(cut.len(), edges + 1);
                    let mut rest = cut.iter();
                    for vertex in &path {
                        prop_assert!(rest.any(|station| station == vertex));
                    }
                }
            }
        }
    }
}
