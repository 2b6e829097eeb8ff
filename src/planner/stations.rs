//! Path segmentation (paper, "Path Segmentation"): a polyline cut into `N` edges.
//!
//! The paper steps along the straight line by `D / N`. A candidate with corners keeps these as
//! stations, each near the place in the sequence that its distance along the path calls for, so
//! that stations with the same index on two candidates are about as far on the way.

use super::polyline::{distance, length};
use crate::geodesy::Xy;

/// Vertices of two polylines this near to each other are the same, metres.
const SAME: f64 = 1e-6;

/// Where stations go that no vertex needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spare {
    /// Along the edges, as in the paper.
    Along,
    /// Where the two polylines are alike and nothing has to be decided: to the edges that they have
    /// in common, or else to the start. A choice between stations that make next to no difference
    /// would only hide from QAOA those that do.
    Alike,
}

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

/// The stations of two polylines with the same ends, at least `edges` edges each. Where both have
/// a vertex in common it is the same station of both, and what is between two of these has the
/// same number of edges, unless this would take more than `edges`. Where the stations go that no
/// vertex needs is for `spare` to say.
///
/// `None` where one of the polylines is no line.
#[must_use]
pub fn aligned(one: &[Xy], other: &[Xy], edges: usize, spare: Spare) -> Option<(Vec<Xy>, Vec<Xy>)> {
    if one.len() < 2 || other.len() < 2 {
        return None;
    }
    let common = common_vertices(one, other);
    let sections: Vec<(&[Xy], &[Xy])> = common
        .windows(2)
        .map(|pair| (&one[pair[0].0..=pair[1].0], &other[pair[0].1..=pair[1].1]))
        .collect();
    let mut counts: Vec<usize> = sections.iter().map(|(a, b)| a.len().max(b.len()) - 1).collect();
    let shared = |k: usize| counts_as_shared(sections[k]);
    if counts.iter().sum::<usize>() > edges && one.len().max(other.len()) <= edges + 1 {
        return Some((stations(one, edges)?, stations(other, edges)?));
    }
    let any_shared = (0..sections.len()).any(shared);
    let needed = counts.iter().sum::<usize>().min(edges);
    if spare == Spare::Alike && !any_shared && needed < edges {
        let mut aligned = aligned(one, other, needed, spare)?;
        for line in [&mut aligned.0, &mut aligned.1] {
            line.splice(0..0, std::iter::repeat_n(line[0], edges - needed));
        }
        return Some(aligned);
    }
    for _ in needed..edges {
        // The section with the longest edges gets one more.
        let longest =
            (0..sections.len()).filter(|&k| !any_shared || shared(k)).max_by(|&j, &k| {
                let step = |k: usize| length(sections[k].0) / counts[k] as f64;
                step(j).total_cmp(&step(k))
            })?;
        counts[longest] += 1;
    }
    let (mut a, mut b) = (vec![one[0]], vec![other[0]]);
    for (k, (on_one, on_other)) in sections.iter().enumerate() {
        a.extend(&stations(on_one, counts[k])?[1..]);
        b.extend(&stations(on_other, counts[k])?[1..]);
    }
    Some((a, b))
}

/// Whether two sections are one and the same edge.
fn counts_as_shared((a, b): (&[Xy], &[Xy])) -> bool {
    a.len() == 2 && b.len() == 2
}

/// The longest sequence of vertices that two polylines have in common, by their places in both;
/// the first and the last vertices always are.
fn common_vertices(one: &[Xy], other: &[Xy]) -> Vec<(usize, usize)> {
    let (n, m) = (one.len(), other.len());
    let same = |i: usize, j: usize| {
        (i == 0 && j == 0)
            || (i == n - 1 && j == m - 1)
            || (i > 0 && j > 0 && i < n - 1 && j < m - 1 && distance(one[i], other[j]) < SAME)
    };
    // lengths[i][j]: of the longest common sequence from i and j on.
    let mut lengths = vec![vec![0u32; m + 1]; n + 1];
    for i in (0..n).rev() {
        for j in (0..m).rev() {
            lengths[i][j] = if same(i, j) {
                lengths[i + 1][j + 1] + 1
            } else {
                lengths[i + 1][j].max(lengths[i][j + 1])
            };
        }
    }
    let (mut i, mut j, mut common) = (0, 0, Vec::new());
    while i < n && j < m {
        if same(i, j) {
            common.push((i, j));
            (i, j) = (i + 1, j + 1);
        } else if lengths[i + 1][j] >= lengths[i][j + 1] {
            i += 1;
        } else {
            j += 1;
        }
    }
    common
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

    #[test]
    fn stations_that_nothing_needs_decide_nothing() {
        let at = |x: f64, y: f64| Xy { x, y };
        let (one, other) = ([at(0., 0.), at(50., 30.), at(100., 0.)], [at(0., 0.), at(100., 0.)]);
        let (a, b) = aligned(&one, &other, 6, Spare::Alike).unwrap();
        assert_eq!((a.len(), b.len()), (7, 7));
        assert_eq!((a[..5].to_vec(), b[..5].to_vec()), (vec![one[0]; 5], vec![one[0]; 5]));
        assert_eq!((a[5], b[5]), (one[1], at(50., 0.)));
        let (a, b) = aligned(&one, &other, 6, Spare::Along).unwrap();
        assert!(a.iter().zip(&b).skip(1).take(5).all(|(a, b)| a != b));
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
