//! What is done with the legs when all of them are known.

use std::collections::{HashMap, HashSet};

use super::super::commands::Role;
use super::super::legs::{Leg, LegEnd, LegKind, LegShape};
use super::Itinerary;
use super::state::bits;
use crate::units::Metres;

impl Itinerary<'_> {
    /// Every place is judged, also one that no leg touches, with its whole circle.
    pub(super) fn stay_at_places_without_legs(&mut self) {
        let mut touched: HashMap<[u64; 2], Metres> = HashMap::new();
        for end in self.legs.iter().flat_map(|leg| [leg.from, leg.to]) {
            let circle = touched.entry(bits(end.position)).or_insert(end.circle);
            *circle = circle.max(end.circle);
        }
        for (item, &place) in self.places.iter().enumerate() {
            let (Role::Place(destination), Some(position)) =
                (self.items[item].command.role(), place)
            else {
                continue;
            };
            let seen = self.passed_takeoffs.contains(&item);
            if seen
                || touched.get(&bits(position)).is_some_and(|&circle| circle >= self.radii[item])
            {
                continue;
            }
            let altitude = self.altitude(item, destination);
            let end = LegEnd { item: Some(item), position, altitude, circle: self.radii[item] };
            self.legs.push(Leg {
                from: end,
                to: end,
                kind: LegKind::Stay,
                shape: LegShape::Straight,
                jump: None,
                insert_before: None,
                by_jump: None,
                behind_jump: false,
            });
        }
    }

    /// Marks the legs that the way without jumps does not come to.
    pub(super) fn mark_what_is_behind_jumps(&mut self) {
        let into: HashSet<usize> = self.legs.iter().filter_map(|leg| leg.to.item).collect();
        let mut onward: HashMap<usize, Vec<usize>> = HashMap::new();
        let mut open = self.first_places.clone();
        for leg in self.legs.iter().filter(|leg| leg.jump.is_none()) {
            match (leg.from.item, leg.to.item) {
                // Where no leg leads to, a takeoff, a hold or nothing at all does.
                (Some(from), to) => {
                    onward.entry(from).or_default().extend(to);
                    open.extend((!into.contains(&from)).then_some(from));
                }
                (None, to) => open.extend(to),
            }
        }
        let mut reached = HashSet::new();
        while let Some(item) = open.pop() {
            if reached.insert(item) {
                open.extend(onward.get(&item).into_iter().flatten());
            }
        }
        for leg in &mut self.legs {
            leg.behind_jump = leg.from.item.is_some_and(|from| !reached.contains(&from));
        }
    }
}
