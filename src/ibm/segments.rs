//! The order in which the first layer's bonds are made: segments grow from a seed bond outwards, one
//! two-qubit gate per bond, and are then joined by ordinary bonds of two gates.
//!
//! Later layers take four two-qubit gates of depth per qubit. The first layer takes no more if an
//! inner end of a segment is attached by step 2, its join being steps 3 and 4, while the segments at the
//! ends of the chain may go on growing outwards until step 4: 6 qubits at each end, 4 in between (8 for
//! a chain that is one segment). That is the fewest joins, so the fewest gates, at that depth.

/// One bond of the first layer; bond i lies between qubits i and i + 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Bond {
    /// Between two untouched qubits.
    Seed(usize),
    /// From a qubit of the segment to an untouched one.
    Grow { bond: usize, from: usize, to: usize },
    /// Between two segments.
    Join(usize),
}

const LONE: usize = 8;
const OUTER: usize = 6;
const INNER: usize = 4;

/// Every bond of a chain once, in an order that can be followed.
pub(super) fn segments(qubits: usize) -> Vec<Bond> {
    let mut bonds = Vec::new();
    let mut joins = Vec::new();
    let mut start = 0;
    while start < qubits {
        let left = qubits - start;
        // Growth to the left of the seed: up to three steps at the chain's end, one elsewhere.
        let (length, before) = match (start, left) {
            (0, ..=LONE) => (left, (left.saturating_sub(1) / 2).min(3)),
            (0, _) => (OUTER, 3),
            (_, ..=OUTER) => (left, 1),
            // Leave something for the last segment to be.
            (_, _) => (INNER.min(left - 1), 1),
        };
        let seed = start + before.min(length.saturating_sub(2));
        if length > 1 {
            bonds.push(Bond::Seed(seed));
            for bond in (start..seed).rev() {
                bonds.push(Bond::Grow { bond, from: bond + 1, to: bond });
            }
            for bond in seed + 1..start + length - 1 {
                bonds.push(Bond::Grow { bond, from: bond, to: bond + 1 });
            }
        }
        start += length;
        if start < qubits {
            joins.push(Bond::Join(start - 1));
        }
    }
    bonds.extend(joins);
    bonds
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps of two-qubit gates until everything is done, or `None` if the order cannot be followed.
    fn depth(qubits: usize) -> Option<usize> {
        let mut touched = vec![0; qubits];
        let mut bonds = vec![false; qubits.saturating_sub(1)];
        for bond in segments(qubits) {
            let (at, steps) = match bond {
                Bond::Seed(at) if touched[at] == 0 && touched[at + 1] == 0 => (at, 1),
                Bond::Grow { bond, from, to } if touched[from] > 0 && touched[to] == 0 => (bond, 1),
                Bond::Join(at) => (at, 2),
                _ => return None,
            };
            let done = touched[at].max(touched[at + 1]) + steps;
            (touched[at], touched[at + 1]) = (done, done);
            assert!(!std::mem::replace(&mut bonds[at], true));
        }
        assert!(bonds.into_iter().all(|done| done));
        touched.into_iter().max()
    }

    #[test]
    fn every_bond_is_made_once_within_four_steps() {
        for qubits in 1..200 {
            assert!(depth(qubits).is_some_and(|depth| depth <= 4), "{qubits}");
        }
    }

    #[test]
    fn joins_are_few() {
        let joins = |qubits| {
            segments(qubits).into_iter().filter(|bond| matches!(bond, Bond::Join(_))).count()
        };
        assert_eq!([8, 9, 12, 13, 20, 21].map(joins), [0, 1, 1, 2, 3, 4]);
    }
}
