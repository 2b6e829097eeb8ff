//! Follows the items of a mission the way an autopilot executes them, and notes every leg.
//!
//! From each place the items after it are walked, along every branch that a jump makes, until the
//! next places. A walk visits an item at most once for each way that the vehicle can be there, so
//! that loops end; the number of steps is bounded for missions that are made to be hostile.

use std::collections::HashSet;

use super::Mission;
use super::altitude::Altitude;
use super::autopilot::Autopilot;
use super::commands::{Destination, LoiterHabit, Role};
use super::curve::{arc_bound, bend_splines, spline_bound};
use super::insertion::insertion_point;
use super::item::{Command, MissionItem};
use super::jumps::Jumps;
use super::legs::{
    FlightContext, JumpInsertion, Leg, LegEnd, LegError, LegKind, LegShape, MissionLegs, ReturnTo,
};
use super::places::{places, radii, warning};
use crate::geodesy::LatLon;
use crate::units::Metres;

mod afterwards;
mod state;

use state::{Landing, State, Status, bits};

/// The most legs, and the most steps for each of them on average, that a mission may take.
const LEG_LIMIT: usize = 100_000;
const STEP_LIMIT: usize = 40 * LEG_LIMIT;

/// The mission as it is walked.
struct Itinerary<'a> {
    items: &'a [MissionItem],
    context: &'a FlightContext<'a>,
    /// The place of each item that has one.
    places: Vec<Option<LatLon>>,
    radii: Vec<Metres>,
    jumps: Jumps,
    /// Takeoffs that ArduPilot comes to elsewhere than at their own place, which it ignores then.
    passed_takeoffs: HashSet<usize>,
    homes: Vec<LatLon>,
    known_homes: HashSet<[u64; 2]>,
    /// A `DO_SET_HOME` at a place that is not known was passed.
    home_lost: bool,
    landings: Vec<usize>,
    /// Items whose places the mission can begin at.
    first_places: Vec<usize>,
    steps: usize,
    legs: Vec<Leg>,
}

/// The legs of a mission.
pub(super) fn follow(
    mission: &Mission,
    context: &FlightContext<'_>,
) -> Result<MissionLegs, LegError> {
    let items = mission.items.as_slice();
    let home = mission.home.map(|home| home.position);
    let places = places(items)?;
    let (radii, mut warnings) = radii(items, context.loiter)?;
    let landings = (0..items.len()).filter(|&i| items[i].command == Command::DO_LAND_START);
    let mut itinerary = Itinerary {
        items,
        context,
        places,
        radii,
        jumps: Jumps::of(items)?,
        passed_takeoffs: HashSet::new(),
        homes: home.into_iter().collect(),
        known_homes: home.into_iter().map(bits).collect(),
        home_lost: false,
        landings: landings.collect(),
        first_places: Vec::new(),
        steps: 0,
        legs: Vec::new(),
    };
    let start = State::start(context.start.or(home));
    // The first pass finds where home is moved to; the returns of the second need all of that.
    itinerary.walk_all(start)?;
    itinerary.legs.clear();
    itinerary.walk_all(start)?;
    itinerary.stay_at_places_without_legs();
    bend_splines(items, &mut itinerary.legs);
    itinerary.mark_what_is_behind_jumps();
    warnings.extend(items.iter().enumerate().filter_map(warning));
    warnings.sort_by_key(|warning| warning.item());
    Ok(MissionLegs { legs: itinerary.legs, warnings })
}

impl Itinerary<'_> {
    fn walk_all(&mut self, start: State) -> Result<(), LegError> {
        self.walk(start)?;
        for item in 0..self.items.len() {
            let role = self.items[item].command.role();
            match (role, self.places[item]) {
                (Role::Place(_), Some(_)) if self.passed_takeoffs.contains(&item) => {}
                (Role::Place(destination), Some(place)) => {
                    self.walk(self.departure(item, destination, place))?;
                }
                (Role::Return, _) => {
                    let rally = self.context.rally.iter();
                    let returned: Vec<LatLon> = self.homes.iter().chain(rally).copied().collect();
                    for position in returned {
                        let circle = self.circle_at_return();
                        self.walk(State { circle, ..State::after(item, position) })?;
                    }
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// How the vehicle leaves the place of an item.
    fn departure(&self, item: usize, destination: Destination, place: LatLon) -> State {
        let status = match destination {
            Destination::Land => Status::Landed,
            _ => Status::Flying,
        };
        let altitude = self.altitude(item, destination);
        State { altitude, status, circle: self.radii[item], ..State::after(item, place) }
    }

    /// The altitude that the vehicle has at an item's place; `None` on the ground.
    fn altitude(&self, item: usize, destination: Destination) -> Option<Altitude> {
        match destination {
            Destination::Land | Destination::PayloadPlace => None,
            _ => Altitude::of(&self.items[item]),
        }
    }

    /// Walks from a state to the next places along every branch.
    fn walk(&mut self, from: State) -> Result<(), LegError> {
        let mut visited = HashSet::new();
        let mut open = vec![from];
        while let Some(state) = open.pop() {
            self.count(1)?;
            let Some(item) = self.items.get(state.index) else { continue };
            if !visited.insert(state.key()) {
                continue;
            }
            let index = state.index;
            let next = State { index: index + 1, ..state };
            match item.command.role() {
                Role::Action | Role::Condition | Role::Tag | Role::Entry | Role::Unknown => {
                    open.push(next);
                }
                Role::SetHome => {
                    self.set_home(index, state.position);
                    open.push(next);
                }
                Role::Jump | Role::TagJump => self.jump(state, &mut open)?,
                Role::PathNotGiven => {
                    return Err(LegError::PathNotGiven { item: index, command: item.command });
                }
                Role::Hold => {
                    open.push(state.past_item());
                }
                Role::Return => self.fly_back(state, &mut open)?,
                Role::Place(Destination::Takeoff) => {
                    open.extend(self.take_off(state)?);
                }
                Role::Place(destination) => open.extend(self.arrive(state, destination)?),
            }
        }
        Ok(())
    }

    /// At a jump: on to the next item, and to where it may lead. One that is always taken goes
    /// nowhere else; if it leads on, past some items, it is no branch of the way either.
    fn jump(&mut self, state: State, open: &mut Vec<State>) -> Result<(), LegError> {
        let index = state.index;
        let item = &self.items[index];
        let always =
            self.context.autopilot.always().is_some_and(|always| {
                item.command.role() == Role::Jump && item.params[1] == always
            });
        if !always {
            open.push(State { index: index + 1, ..state });
        }
        let destinations = self.jumps.destinations(index);
        for &target in destinations {
            let onward = always && target > index;
            let first = !state.jumped && state.landing.is_none() && target < self.items.len();
            let by_jump = self
                .context
                .autopilot
                .always()
                .filter(|_| first && item.command.role() == Role::Jump)
                .map(|always| JumpInsertion { jump: index, target, always });
            let jump = if onward { state.jump } else { state.jump.or(Some(index)) };
            open.push(State { index: target, jump, jumped: true, by_jump, ..state });
        }
        let branches = destinations.len();
        self.count(branches)
    }

    fn count(&mut self, steps: usize) -> Result<(), LegError> {
        self.steps += steps;
        if self.steps > STEP_LIMIT {
            return Err(LegError::TooManyLegs { limit: LEG_LIMIT });
        }
        Ok(())
    }

    fn set_home(&mut self, item: usize, position: Option<LatLon>) {
        match self.places[item].or(position) {
            Some(home) if self.known_homes.insert(bits(home)) => self.homes.push(home),
            Some(_) => {}
            None => self.home_lost = true,
        }
    }

    /// At a takeoff: the state that the vehicle goes on in from where it is; `None` where it goes
    /// on only from the takeoff's own place.
    fn take_off(&mut self, state: State) -> Result<Option<State>, LegError> {
        let index = state.index;
        let place = self.places[index];
        if let (Some(place), Some(from)) = (place, state.position)
            && self.context.autopilot != Autopilot::ArduPilot
            && place.to_e7() != from.to_e7()
        {
            let altitude = self.altitude(index, Destination::Takeoff);
            let end =
                |position| LegEnd { item: Some(index), position, altitude, circle: Metres::ZERO };
            let from = LegEnd { item: state.navigation, circle: state.circle, ..end(from) };
            self.push(&state, from, end(place), LegKind::Takeoff, LegShape::Straight)?;
        }
        let position = match (place, self.context.autopilot) {
            (None, _) => state.position,
            (Some(place), Autopilot::ArduPilot) => {
                self.passed_takeoffs.insert(index);
                state.position.or(Some(place))
            }
            (Some(_), Autopilot::Px4) => return Ok(None),
            (Some(place), Autopilot::Unknown) => match state.position {
                Some(from) if from.to_e7() != place.to_e7() => state.position,
                _ => return Ok(None),
            },
        };
        Ok(Some(State {
            position,
            altitude: self.altitude(index, Destination::Takeoff),
            circle: Metres::ZERO,
            status: Status::Flying,
            ..state.past_item()
        }))
    }

    /// At an item with a place, or that is done where the vehicle is: notes the leg to it. Returns
    /// the state to go on in, unless the item has a place of its own and is thereby the start of
    /// other legs.
    fn arrive(
        &mut self,
        state: State,
        destination: Destination,
    ) -> Result<Option<State>, LegError> {
        let index = state.index;
        let circle = self.radii[index];
        let to = |position, altitude| LegEnd { item: Some(index), position, altitude, circle };
        if let Some(place) = self.places[index] {
            if state.status == Status::Before && state.jump.is_none() {
                self.first_places.push(index);
            }
            if state.status == Status::Flying {
                let from = self.leave(&state)?;
                let to = to(place, self.altitude(index, destination));
                let shape = self.shape(destination, &from, &to);
                self.push(&state, from, to, LegKind::Flown, shape)?;
            }
            return Ok(None);
        }
        let on = state.past_item();
        match (state.status, destination) {
            (Status::Landed, _) => Ok(None),
            (Status::Before, _) => Ok(Some(on)),
            (Status::Flying, Destination::Land) => {
                Ok(Some(State { status: Status::Landed, altitude: None, ..on }))
            }
            (Status::Flying, _) => {
                let altitude = match self.altitude(index, destination) {
                    Some(altitude) if altitude.metres != 0.0 => Some(altitude),
                    _ => state.altitude,
                };
                if circle > Metres::ZERO {
                    let here = self.leave(&state)?;
                    let to = to(here.position, altitude);
                    self.push(&state, to, to, LegKind::Stay, LegShape::Straight)?;
                }
                Ok(Some(State { altitude, circle: circle.max(state.circle), ..on }))
            }
        }
    }

    /// At an item that returns: to home, the rally points and the landing sequences.
    fn fly_back(&mut self, state: State, open: &mut Vec<State>) -> Result<(), LegError> {
        let index = state.index;
        if state.status != Status::Flying {
            open.push(state.past_item());
            return Ok(());
        }
        if state.landing.is_some() {
            return Ok(());
        }
        let from = self.leave(&state)?;
        if self.homes.is_empty() || self.home_lost {
            return Err(LegError::HomeUnknown { item: index });
        }
        let circle = self.circle_at_return();
        let homes = self.homes.iter().map(|&home| (home, ReturnTo::Home));
        let rally = self.context.rally.iter().enumerate();
        let rally = rally.map(|(k, &point)| (point, ReturnTo::Rally(k)));
        let destinations: Vec<_> = homes.chain(rally).collect();
        for (position, to) in destinations {
            let end = LegEnd { item: Some(index), position, altitude: None, circle };
            self.push(&state, from, end, LegKind::Return(to), LegShape::Straight)?;
        }
        let insert_before = self.insertion(&state, index);
        self.count(self.landings.len())?;
        open.extend(self.landings.iter().map(|&entry| State {
            index: entry + 1,
            landing: Some(Landing { entry, insert_before }),
            ..state
        }));
        Ok(())
    }

    /// A fixed wing circles where it has returned to.
    fn circle_at_return(&self) -> Metres {
        match self.context.loiter {
            LoiterHabit::Circle { radius } => radius,
            _ => Metres::ZERO,
        }
    }

    fn leave(&self, state: &State) -> Result<LegEnd, LegError> {
        let item = state.navigation.unwrap_or(state.index);
        state.position.map(|from| state.end(from)).ok_or(LegError::StartUnknown { item })
    }

    fn insertion(&self, state: &State, end: usize) -> Option<usize> {
        let first = state.navigation.map_or(0, |item| item + 1);
        match state.jumped {
            false => insertion_point(self.items, &self.jumps, first, end),
            true => None,
        }
    }

    fn push(
        &mut self,
        state: &State,
        from: LegEnd,
        to: LegEnd,
        kind: LegKind,
        shape: LegShape,
    ) -> Result<(), LegError> {
        if self.legs.len() >= LEG_LIMIT {
            return Err(LegError::TooManyLegs { limit: LEG_LIMIT });
        }
        let insert_before = match (kind, shape) {
            (LegKind::Flown | LegKind::Return(_), LegShape::Straight) => match state.landing {
                Some(landing) => landing.insert_before,
                None => self.insertion(state, state.index),
            },
            _ => None,
        };
        let by_jump = match (kind, shape) {
            (LegKind::Flown | LegKind::Return(_), LegShape::Straight) => state.by_jump,
            _ => None,
        };
        let kind = match (kind, state.landing) {
            (LegKind::Flown, Some(l)) => LegKind::Return(ReturnTo::LandingSequence(l.entry)),
            _ => kind,
        };
        self.legs.push(Leg {
            from,
            to,
            kind,
            shape,
            jump: state.jump,
            insert_before,
            by_jump,
            behind_jump: false,
        });
        Ok(())
    }

    fn shape(&self, destination: Destination, from: &LegEnd, to: &LegEnd) -> LegShape {
        let item = to.item.map(|item| &self.items[item]);
        match (destination, item) {
            (Destination::Spline, _) => {
                let any = spline_bound(from, to);
                LegShape::Curved { within: any, overshoot: any }
            }
            (Destination::Arc, Some(item)) => LegShape::Curved {
                within: arc_bound(f64::from(item.params[0]), from, to),
                overshoot: Some(Metres::ZERO),
            },
            _ => LegShape::Straight,
        }
    }
}

#[cfg(test)]
mod tests;
