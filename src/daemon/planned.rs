//! What was planned last, and whether that still counts. Pure.
//!
//! A plan is made for what the vehicle holds and on a basis: the parameters in force, the place the
//! vehicle stands at, whether it is armed. Where the basis changes while something is planned or
//! written, its outcome is for the old one, and does not count as planned.

use sha2::{Digest, Sha256};

use super::place::Place;
use crate::cli::reading::Held;
use crate::mission::MissionItem;
use crate::vehicle::Autopilot;

/// What a vehicle holds, as a number that differs where the plans differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Fingerprint([u8; 32]);

impl Fingerprint {
    /// Of downloaded plans. Home, which ArduPilot keeps in the mission, is no part of it: it moves
    /// with every fix.
    pub(super) fn of(autopilot: Autopilot, held: &Held) -> Self {
        let homes = usize::from(autopilot == Autopilot::ArduPilot).min(held.mission.len());
        let mut hash = Sha256::new();
        for items in [&held.mission[homes..], &held.fence, &held.rally] {
            hash.update((items.len() as u64).to_le_bytes());
            for item in items {
                hash_item(&mut hash, item);
            }
        }
        Self(hash.finalize().into())
    }
}

fn hash_item(hash: &mut Sha256, item: &MissionItem) {
    hash.update(item.command.0.to_le_bytes());
    hash.update([item.frame.0, item.autocontinue]);
    for param in item.params {
        hash.update(param.to_bits().to_le_bytes());
    }
    hash.update(item.x.to_le_bytes());
    hash.update(item.y.to_le_bytes());
    hash.update(item.z.to_bits().to_le_bytes());
}

/// What was planned last.
#[derive(Debug, Default)]
pub(super) struct Planned {
    fingerprint: Option<Fingerprint>,
    from: Option<Place>,
    basis: Basis,
}

/// The parameters and the place that plans are made on, as a number that each change counts up.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub(super) struct Basis(u64);

impl Planned {
    /// What the vehicle held when it was planned for: not planned again while it holds that.
    pub(super) fn fingerprint(&self) -> Option<Fingerprint> {
        self.fingerprint
    }

    /// Where it was planned from.
    pub(super) fn from(&self) -> Option<Place> {
        self.from
    }

    /// What work that begins now is done on.
    pub(super) fn basis(&self) -> Basis {
        self.basis
    }

    /// The basis is another one: what was planned, and what is being planned, is to be planned
    /// anew.
    pub(super) fn forget(&mut self) {
        *self = Self { fingerprint: None, from: None, basis: Basis(self.basis.0 + 1) };
    }

    /// What was planned on a basis. Not kept where that is not in force any more.
    pub(super) fn keep(
        &mut self,
        basis: Basis,
        fingerprint: Option<Fingerprint>,
        from: Option<Place>,
    ) {
        if basis == self.basis {
            (self.fingerprint, self.from) = (fingerprint, from);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_begun_on_an_old_basis_does_not_count_as_planned() {
        let fingerprint = Some(Fingerprint([7; 32]));
        let mut planned = Planned::default();
        let before = planned.basis();
        planned.forget();
        planned.keep(before, fingerprint, None);
        assert_eq!(planned.fingerprint(), None);
        planned.keep(planned.basis(), fingerprint, None);
        assert_eq!(planned.fingerprint(), fingerprint);
        planned.forget();
        assert_eq!(planned.fingerprint(), None);
    }
}
