//! Two polylines as a trellis: `2^(N−1)` paths, whose costs are an Ising chain.
//!
//! Station `i` of the path is `a_i` (bit 0) or `b_i` (bit 1). With `N` edges and one qubit an
//! edge, qubit `i` (from 0 here, from 1 in the paper) says where edge `i` starts; the last edge
//! ends in the goal. The paper writes `H_C = Σ C(e_i) Z_i`; an edge's cost depends on where both
//! its ends are, so that the exact Hamiltonian also has the neighbour couplings that the paper's
//! circuit applies (CNOT–RZ–CNOT, "Quantum-Assisted Optimization").

use std::ops::Range;

use super::leg_space::LegSpace;
use super::polyline::distance;
use crate::geodesy::Xy;
use crate::qaoa::{Bits, ChainIsing, IsingError};

/// What the paper reports for an edge that meets an obstacle ("Cost Assignment").
pub const COLLISION_COST: f64 = 1e6;

/// The smallest cap of the collision penalty in the Hamiltonian, metres.
const LEAST_PENALTY_CAP: f64 = 60.0;

/// The cap of the penalty as a share of the path's length. Some 200 m were found to work for
/// legs of 400 to 900 m.
const PENALTY_CAP_SHARE: f64 = 0.3;

/// What is known of one edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Metres.
    pub length: f64,
    /// Whether it comes nearer to something than the planning margin.
    pub collides: bool,
    /// The paper's `λ exp(−d/d_s)`, metres.
    pub proximity: f64,
}

impl Edge {
    /// Length, proximity term, and [`COLLISION_COST`] where it collides: the cost that decoded
    /// paths are judged by.
    #[must_use]
    pub fn cost(&self) -> f64 {
        if self.collides { COLLISION_COST } else { self.length + self.proximity }
    }

    /// The same with a collision counted as `penalty` on top: what the Hamiltonian sees.
    fn energy(&self, penalty: f64) -> f64 {
        self.length + self.proximity + if self.collides { penalty } else { 0.0 }
    }
}

/// How an edge is judged.
#[derive(Debug, Clone, Copy)]
pub struct EdgeJudge<'a> {
    /// The leg's airspace.
    pub space: LegSpace<'a>,
    /// `λ`, metres.
    pub lambda: f64,
    /// `d_s`, metres.
    pub safety_margin: f64,
}

impl EdgeJudge<'_> {
    /// Measures an edge (paper, "Cost Assignment").
    #[must_use]
    pub fn edge(&self, a: Xy, b: Xy) -> Edge {
        // Beyond eight margins the proximity term is below a thousandth of λ.
        let horizon = 8.0 * self.safety_margin;
        let clearance =
            self.space.airspace().nearest(a, b, horizon).map(|(clearance, _)| clearance);
        let collides = clearance.is_some_and(|clearance| clearance < self.space.planning_margin());
        let clearance = clearance.unwrap_or(f64::INFINITY);
        let proximity = self.lambda * (-clearance / self.safety_margin).exp();
        Edge { length: distance(a, b), collides, proximity }
    }
}

/// Two polylines with the same number of stations, and all edges between them.
#[derive(Debug, Clone)]
pub struct Trellis {
    /// The incumbent's stations `a_0 … a_N`.
    incumbent: Vec<Xy>,
    /// The challenger's stations `b_0 … b_N`; the ends are the incumbent's.
    challenger: Vec<Xy>,
    /// `edges[i][x][y]`: from the station that bit `x` chooses to the next that `y` chooses.
    edges: Vec<[[Edge; 2]; 2]>,
}

impl Trellis {
    /// Judges all edges. Both polylines have the same number of stations (at least two) and the
    /// same ends.
    #[must_use]
    pub fn new(incumbent: Vec<Xy>, challenger: Vec<Xy>, judge: &EdgeJudge<'_>) -> Self {
        debug_assert_eq!(incumbent.len(), challenger.len());
        debug_assert_eq!(incumbent.first(), challenger.first());
        debug_assert_eq!(incumbent.last(), challenger.last());
        let edges = incumbent
            .windows(2)
            .zip(challenger.windows(2))
            .map(|(a, b)| {
                let kept = judge.edge(a[0], a[1]);
                // Stations that were not moved share their edges.
                let measure = |from: Xy, to: Xy| {
                    if (from, to) == (a[0], a[1]) { kept } else { judge.edge(from, to) }
                };
                let out = measure(a[0], b[1]);
                let back = if b[0] == a[0] { kept } else { judge.edge(b[0], a[1]) };
                let moved = if b[0] == a[0] { out } else { measure(b[0], b[1]) };
                [[kept, out], [back, moved]]
            })
            .collect();
        Self { incumbent, challenger, edges }
    }

    /// Qubits: one for each edge.
    #[must_use]
    pub fn qubits(&self) -> usize {
        self.edges.len()
    }

    /// The edges of the path that a bitstring stands for.
    pub fn path_edges<'a>(&'a self, bits: &'a Bits) -> impl Iterator<Item = Edge> + 'a {
        let last = self.edges.len() - 1;
        (0..=last).map(move |i| {
            let to = i < last && bits.get(i + 1);
            self.edges[i][usize::from(bits.get(i))][usize::from(to)]
        })
    }

    /// Whether a qubit has nothing to decide: the two polylines share its station.
    #[must_use]
    pub fn is_idle(&self, qubit: usize) -> bool {
        self.incumbent[qubit] == self.challenger[qubit]
    }

    /// The stations of the path that a bitstring stands for.
    #[must_use]
    pub fn decode(&self, bits: &Bits) -> Vec<Xy> {
        let choose = |(i, (a, b)): (usize, (&Xy, &Xy))| {
            if i < self.qubits() && bits.get(i) { *b } else { *a }
        };
        self.incumbent.iter().zip(&self.challenger).enumerate().map(choose).collect()
    }

    /// What a collision costs in the Hamiltonian of a window of qubits, those outside held: the
    /// smallest `M` that makes every colliding path dearer than the cheapest clean one, capped so
    /// that the spectrum stays well conditioned. (With the paper's 10⁶ every phase would wrap
    /// thousands of times.)
    #[must_use]
    pub fn penalty(&self, window: &Range<usize>, held: &Bits) -> f64 {
        // Dynamic programme over (bit, has collided): cheapest so far without the penalty. It
        // begins with the edge that leads into the window and ends with the one out of it.
        let mut best = [[f64::INFINITY; 2]; 2];
        let first = window.start.saturating_sub(1);
        for (bit, best) in best.iter_mut().enumerate() {
            if window.start == 0 || usize::from(held.get(first)) == bit {
                best[0] = 0.0;
            }
        }
        for i in first..window.end {
            let edge = &self.edges[i];
            let ends = match i + 1 {
                next if next < window.end => 0..2,
                next if next < self.edges.len() => {
                    let bit = usize::from(held.get(next));
                    bit..bit + 1
                }
                _ => 0..1,
            };
            let mut next = [[f64::INFINITY; 2]; 2];
            for x in 0..2 {
                for y in ends.clone() {
                    for (collided, so_far) in best[x].iter().enumerate() {
                        let after = collided | usize::from(edge[x][y].collides);
                        let cost = so_far + edge[x][y].energy(0.0);
                        next[y][after] = cost.min(next[y][after]);
                    }
                }
            }
            best = next;
        }
        let least = |collided: usize| best[0][collided].min(best[1][collided]);
        let (clean, colliding) = (least(0), least(1));
        let part = &self.incumbent[first..=window.end];
        let cap = (PENALTY_CAP_SHARE * super::polyline::length(part)).max(LEAST_PENALTY_CAP);
        if !colliding.is_finite() {
            return 0.0;
        }
        // A little more than the difference, so that a tie is none.
        (clean - colliding + 0.01 * cap).clamp(0.01 * cap, cap)
    }

    /// The cost as an Ising chain, `z = 1 − 2x`, metres. A bitstring's energy is the cost of its
    /// path, with a collision counted as `penalty`; plus the bias of the first qubit, 0 for bit 0.
    ///
    /// # Errors
    /// [`IsingError`] where a cost is not finite.
    pub fn ising(&self, penalty: f64) -> Result<ChainIsing, IsingError> {
        let n = self.edges.len();
        let mut h = vec![0.0; n];
        let mut j = vec![0.0; n.saturating_sub(1)];
        let mut constant = 0.0;
        for (i, edge) in self.edges.iter().enumerate() {
            let t = |x: usize, y: usize| edge[x][y].energy(penalty);
            if i + 1 < n {
                h[i] += (t(0, 0) + t(0, 1) - t(1, 0) - t(1, 1)) / 4.0;
                h[i + 1] += (t(0, 0) + t(1, 0) - t(0, 1) - t(1, 1)) / 4.0;
                j[i] += (t(0, 0) + t(1, 1) - t(0, 1) - t(1, 0)) / 4.0;
                constant += (t(0, 0) + t(0, 1) + t(1, 0) + t(1, 1)) / 4.0;
            } else {
                h[i] += (t(0, 0) - t(1, 0)) / 2.0;
                constant += f64::midpoint(t(0, 0), t(1, 0));
            }
        }
        // The paper's −10³ on the start segment "ensures that the path always begins at the
        // start"; here both stations of qubit 0 are the start, and the bias only has to choose
        // one of two equal bits. At 10³ m it would drown the other terms once H is divided by σ;
        // the mean size of the other fields is enough. The same goes for every other station
        // that the two polylines share.
        let idle: Vec<usize> =
            (0..n).filter(|&i| self.incumbent[i] == self.challenger[i]).collect();
        let size = h.iter().map(|field| field.abs()).sum::<f64>();
        let bias = (size / (n - idle.len()).max(1) as f64).max(f64::EPSILON);
        for i in idle {
            h[i] -= bias;
            constant += bias;
        }
        ChainIsing::new(constant, h, j)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::qaoa::Ising;

    fn edge(length: f64, collides: bool) -> Edge {
        Edge { length, collides, proximity: 0.0 }
    }

    fn trellis(costs: &[[f64; 4]], collisions: &[[bool; 4]]) -> Trellis {
        // Only the ends are shared: the bias of shared stations is no part of the cost.
        let n = costs.len();
        let incumbent: Vec<Xy> = (0..=n).map(|i| Xy { x: i as f64, y: 0. }).collect();
        let mut challenger = incumbent.clone();
        challenger[1..n].iter_mut().for_each(|station| station.y = 1.);
        let mut edges: Vec<[[Edge; 2]; 2]> = costs
            .iter()
            .zip(collisions)
            .map(|(c, k)| {
                [[edge(c[0], k[0]), edge(c[1], k[1])], [edge(c[2], k[2]), edge(c[3], k[3])]]
            })
            .collect();
        edges[0][1] = edges[0][0];
        Trellis { incumbent, challenger, edges }
    }

    fn all_bits(n: usize) -> impl Iterator<Item = Bits> {
        (0..1u32 << n).map(move |k| Bits::from_fn(n, |i| k >> i & 1 == 1))
    }

    fn costs() -> impl Strategy<Value = (Vec<[f64; 4]>, Vec<[bool; 4]>)> {
        (2usize..8).prop_flat_map(|n| {
            (
                prop::collection::vec(prop::array::uniform4(1.0f64..50.0), n),
                prop::collection::vec(prop::array::uniform4(prop::bool::weighted(0.3)), n),
            )
        })
    }

    proptest! {
        #[test]
        fn the_energy_of_a_bitstring_is_the_cost_of_its_path((lengths, collisions) in costs()) {
            let trellis = trellis(&lengths, &collisions);
            let penalty = 37.0;
            let ising: Ising = trellis.ising(penalty).unwrap().into();
            let bias = 2.0 * (ising.constant() - trellis.ising(penalty).unwrap().constant()).abs();
            prop_assert!(bias < 1e-9);
            for bits in all_bits(lengths.len()).filter(|bits| !bits.get(0)) {
                let path: f64 = trellis.path_edges(&bits).map(|edge| edge.energy(penalty)).sum();
                prop_assert!((ising.energy(&bits) - path).abs() < 1e-9);
            }
        }

        #[test]
        fn below_its_cap_the_penalty_puts_a_clean_path_first((lengths, collisions) in costs()) {
            let trellis = trellis(&lengths, &collisions);
            let n = lengths.len();
            let penalty = trellis.penalty(&(0..n), &Bits::zeros(n));
            prop_assume!(penalty < LEAST_PENALTY_CAP);
            let cheapest = |clean: bool| {
                all_bits(lengths.len())
                    .filter(|bits| clean != trellis.path_edges(bits).any(|edge| edge.collides))
                    .map(|bits| trellis.path_edges(&bits).map(|e| e.energy(penalty)).sum::<f64>())
                    .fold(f64::INFINITY, f64::min)
            };
            prop_assert!(cheapest(true) < cheapest(false) || cheapest(true) == f64::INFINITY);
        }
    }
}
