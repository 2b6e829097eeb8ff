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
