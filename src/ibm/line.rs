//! [`Line`]: the physical qubits a chain is laid on, so that no SWAP is ever needed, and the search for
//! the best one.
//!
//! "Best" is the lowest product of errors: every two-qubit gate, every pulse and every readout that the
//! circuit will make, with the calibration of the qubits it is made on. Minus the logarithm of that
//! product is a sum over bonds and qubits, so a branch-and-bound search is exact: a path so far can
//! never end below its own cost plus the cheapest non-reversing *walk* that completes it, and such walks
//! are a small dynamic programme. Faulty qubits and couplers do not exist here ([`Device`] drops them).

use thiserror::Error;

use super::device::{Device, Native, PhysicalQubit};

/// Steps of the exact search before it settles for the best line seen. A chain of 20 on a 127-qubit
/// Eagle takes some hundreds.
const MAX_STEPS: u64 = 5_000_000;
/// Partial lines kept per length by the beam search that finds the first line.
const BEAM: usize = 2_000;

/// Which part of a bond's native gate a qubit is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Direction {
    /// The qubit with the lower position controls.
    Forward,
    /// The qubit with the higher position controls.
    Backward,
}

/// How often a circuit uses each part of its line.
#[derive(Debug, Clone, PartialEq)]
pub struct Demand {
    /// Two-qubit gates per bond; one fewer than there are qubits.
    pub bonds: Vec<u32>,
    /// Pulses (sx, x, rx) per qubit, given the directions of its left and right bond
    /// (`pulses[qubit][left][right]`, 0 for [`Direction::Forward`]); at the ends, where there is no such
    /// bond, both entries are the same.
    pub pulses: Vec<[[u32; 2]; 2]>,
}

/// A simple path in the device's coupling map.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    pub(super) qubits: Vec<PhysicalQubit>,
    pub(super) native: Native,
    pub(super) directions: Vec<Direction>,
    pub(super) success: f64,
    pub(super) proven: bool,
}

/// No line of that length.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum LineError {
    /// Fewer usable qubits than the chain has.
    #[error(
        "{device} has {usable} qubits in working order for a chain of {wanted}; use fewer qubits \
         (--qubits) or another backend"
    )]
    TooFewQubits {
        /// The backend.
        device: String,
        /// Qubits whose gates and readout work.
        usable: usize,
        /// Qubits of the chain.
        wanted: usize,
    },
    /// None exists, or none was found.
    #[error(
        "no line of {wanted} working qubits {} on {device}; use fewer qubits (--qubits) or another \
         backend", if *.exhausted { "exists" } else { "was found" }
    )]
    NoLine {
        /// The backend.
        device: String,
        /// Qubits of the chain.
        wanted: usize,
        /// Whether the search was complete.
        exhausted: bool,
    },
}

impl Line {
    /// The line with the lowest product of errors over `demand`; equal ones are told apart by the
    /// order of the qubits' numbers, so the same calibration gives the same line.
    ///
    /// # Errors
    /// If the device has no such line, or none was found within the search's bounds.
    pub fn choose(device: &Device, native: Native, demand: &Demand) -> Result<Self, LineError> {
        Search::new(device, native, demand).run()
    }

    /// Position → physical qubit.
    #[must_use]
    pub fn qubits(&self) -> &[PhysicalQubit] {
        &self.qubits
    }

    /// The gates it was chosen for.
    #[must_use]
    pub fn native(&self) -> Native {
        self.native
    }

    /// The native direction of each bond.
    #[must_use]
    pub fn directions(&self) -> &[Direction] {
        &self.directions
    }

    /// Probability that no gate and no readout fails: Π (1 − error) over the demand it was chosen for.
    #[must_use]
    pub fn success(&self) -> f64 {
        self.success
    }

    /// Whether the search proved that no better line exists.
    #[must_use]
    pub fn is_proven_best(&self) -> bool {
        self.proven
    }
}

/// An ordered pair of neighbours and what a gate between them costs.
#[derive(Debug, Clone, Copy)]
struct Step {
    from: usize,
    to: usize,
    direction: Direction,
    /// −ln(1 − error) of one gate.
    cost: f64,
}

struct Search<'a> {
    device: &'a Device,
    native: Native,
    demand: &'a Demand,
    /// −ln(1 − error) of one pulse; infinite for unusable qubits.
    pulse: Vec<f64>,
    readout: Vec<f64>,
    steps: Vec<Step>,
    /// Steps that leave a qubit, in the order of where they lead.
    leaving: Vec<Vec<usize>>,
    /// `bound[position][step]`: what it costs at least to complete a walk whose bond `position` is
    /// `step`, the cost of that bond and of the qubit before it not included.
    bound: Vec<Vec<f64>>,
    best_cost: f64,
    best: Option<Vec<usize>>,
    budget: u64,
}

fn logarithm(error: f64) -> f64 {
    -(-error).ln_1p()
}

impl<'a> Search<'a> {
    fn new(device: &'a Device, native: Native, demand: &'a Demand) -> Self {
        let cost = |error: Option<f64>| error.map_or(f64::INFINITY, logarithm);
        let usable = device.qubits().iter();
        let pulse = usable.clone().map(|q| cost(q.sx.map(|sx| sx.error))).collect();
        let readout = usable.map(|q| cost(q.readout.map(|readout| readout.error))).collect();
        let mut steps: Vec<Step> = device
            .couplers(native.entangler)
            .flat_map(|(control, target, calibration)| {
                let (control, target) = (control.index(), target.index());
                let cost = logarithm(calibration.error);
                let forward =
                    Step { from: control, to: target, direction: Direction::Forward, cost };
                let backward =
                    Step { from: target, to: control, direction: Direction::Backward, cost };
                [forward, backward]
            })
            .collect();
        // One step per ordered pair: the better gate where a pair has one in each direction.
        steps.sort_by(|a, b| {
            let key = |step: &Step| (step.from, step.to);
            key(a).cmp(&key(b)).then(a.cost.total_cmp(&b.cost)).then(a.direction.cmp(&b.direction))
        });
        steps.dedup_by_key(|step| (step.from, step.to));
        let mut leaving = vec![Vec::new(); device.qubits().len()];
        for (index, step) in steps.iter().enumerate() {
            leaving[step.from].push(index);
        }
        let mut search = Self {
            device,
            native,
            demand,
            pulse,
            readout,
            steps,
            leaving,
            bound: Vec::new(),
            best_cost: f64::INFINITY,
            best: None,
            budget: MAX_STEPS,
        };
        search.bound = search.bounds();
        search
    }

    /// The cost of a qubit at a position between two bonds; a missing bond is the other one's twin.
    fn qubit(&self, position: usize, qubit: usize, left: Direction, right: Direction) -> f64 {
        let pulses = self.demand.pulses[position][left as usize][right as usize];
        f64::from(pulses) * self.pulse[qubit] + self.readout[qubit]
    }

    fn bond(&self, position: usize, step: &Step) -> f64 {
        f64::from(self.demand.bonds[position]) * step.cost
    }

    /// Steps that may follow `step`, with the cost of the qubit between them and of the new bond.
    fn following(&self, position: usize, step: Step) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.leaving[step.to].iter().filter_map(move |&next| {
            let after = &self.steps[next];
            (after.to != step.from).then(|| {
                let between = self.qubit(position + 1, step.to, step.direction, after.direction);
                (next, between + self.bond(position + 1, after))
            })
        })
    }

    fn bounds(&self) -> Vec<Vec<f64>> {
        let bonds = self.demand.bonds.len();
        let mut bound = vec![Vec::new(); bonds];
        for position in (0..bonds).rev() {
            let last = position + 1 == bonds;
            bound[position] = self
                .steps
                .iter()
                .map(|&step| match last {
                    true => self.qubit(bonds, step.to, step.direction, step.direction),
                    false => self
                        .following(position, step)
                        .map(|(next, cost)| cost + bound[position + 1][next])
                        .fold(f64::INFINITY, f64::min),
                })
                .collect();
        }
        bound
    }

    fn run(mut self) -> Result<Line, LineError> {
        let wanted = self.demand.pulses.len();
        let device = self.device.name().to_owned();
        let usable = self.device.qubits().iter().filter(|qubit| qubit.usable()).count();
        if usable < wanted {
            return Err(LineError::TooFewQubits { device, usable, wanted });
        }
        if wanted == 1 {
            return self.single().ok_or(LineError::NoLine { device, wanted, exhausted: true });
        }
        self.beam();
        let mut visited = vec![false; self.device.qubits().len()];
        let mut path = Vec::with_capacity(wanted);
        for (start, cost) in self.starts() {
            let step = self.steps[start];
            visited[step.from] = true;
            visited[step.to] = true;
            path.push(start);
            self.descend(&mut path, &mut visited, cost);
            path.pop();
            visited[step.from] = false;
            visited[step.to] = false;
        }
        let exhausted = self.budget > 0;
        let Some(best) = self.best.take() else {
            return Err(LineError::NoLine { device, wanted, exhausted });
        };
        let name = |qubit: usize| PhysicalQubit(qubit as u32);
        let first = self.steps[best[0]].from;
        let rest = best.iter().map(|&step| self.steps[step].to);
        Ok(Line {
            qubits: std::iter::once(first).chain(rest).map(name).collect(),
            native: self.native,
            directions: best.iter().map(|&step| self.steps[step].direction).collect(),
            success: (-self.best_cost).exp(),
            proven: exhausted,
        })
    }

    fn single(&self) -> Option<Line> {
        let cost = |&qubit: &usize| self.qubit(0, qubit, Direction::Forward, Direction::Forward);
        let best = (0..self.device.qubits().len()).min_by(|a, b| cost(a).total_cmp(&cost(b)))?;
        let success = (-cost(&best)).exp();
        (success > 0.0).then(|| Line {
            qubits: vec![PhysicalQubit(best as u32)],
            native: self.native,
            directions: Vec::new(),
            success,
            proven: true,
        })
    }

    /// First bonds with their cost, most promising first.
    fn starts(&self) -> Vec<(usize, f64)> {
        let mut starts: Vec<(usize, f64)> = (0..self.steps.len())
            .map(|index| {
                let step = &self.steps[index];
                let first = self.qubit(0, step.from, step.direction, step.direction);
                (index, first + self.bond(0, step))
            })
            .collect();
        let total = |&(step, cost): &(usize, f64)| cost + self.bound[0][step];
        starts.sort_by(|a, b| total(a).total_cmp(&total(b)));
        starts
    }

    /// Steps that continue a path, with the cost so far, most promising first.
    fn continuations(
        &self,
        position: usize,
        last: usize,
        cost: f64,
        visited: impl Fn(usize) -> bool,
    ) -> Vec<(usize, f64)> {
        let mut next: Vec<(usize, f64)> = self
            .following(position, self.steps[last])
            .filter(|&(next, _)| !visited(self.steps[next].to))
            .map(|(next, added)| (next, cost + added))
            .collect();
        let total = |&(step, cost): &(usize, f64)| cost + self.bound[position + 1][step];
        next.sort_by(|a, b| total(a).total_cmp(&total(b)));
        next
    }

    /// Explores everything that starts with `path` and could still beat the best line.
    fn descend(&mut self, path: &mut Vec<usize>, visited: &mut [bool], cost: f64) {
        let position = path.len() - 1;
        let last = path[position];
        let total = cost + self.bound[position][last];
        if self.budget == 0 || total >= self.best_cost {
            return;
        }
        self.budget -= 1;
        if path.len() == self.demand.bonds.len() {
            self.best_cost = total;
            self.best = Some(path.clone());
            return;
        }
        for (next, cost) in self.continuations(position, last, cost, |qubit| visited[qubit]) {
            let to = self.steps[next].to;
            visited[to] = true;
            path.push(next);
            self.descend(path, visited, cost);
            path.pop();
            visited[to] = false;
        }
    }

    /// A good first line, so that the exact search prunes from the start, and the result where the
    /// exact search has to give up.
    fn beam(&mut self) {
        let mut paths: Vec<(f64, Vec<usize>)> =
            self.starts().into_iter().map(|(start, cost)| (cost, vec![start])).collect();
        for position in 0..self.demand.bonds.len() - 1 {
            let mut longer: Vec<(f64, f64, Vec<usize>)> = Vec::new();
            for (cost, path) in &paths {
                let visited = |qubit: usize| {
                    self.steps[path[0]].from == qubit
                        || path.iter().any(|&step| self.steps[step].to == qubit)
                };
                for (next, cost) in self.continuations(position, path[position], *cost, visited) {
                    let total = cost + self.bound[position + 1][next];
                    if total.is_finite() {
                        let path = path.iter().copied().chain([next]).collect();
                        longer.push((total, cost, path));
                    }
                }
            }
            longer.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.2.cmp(&b.2)));
            longer.truncate(BEAM);
            paths = longer.into_iter().map(|(_, cost, path)| (cost, path)).collect();
        }
        let bonds = self.demand.bonds.len();
        for (cost, path) in paths {
            let total = cost + self.bound[bonds - 1][path[bonds - 1]];
            if total < self.best_cost {
                self.best_cost = total;
                self.best = Some(path);
            }
        }
    }
}

#[cfg(test)]
mod tests;
