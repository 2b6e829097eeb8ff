//! Follows the items of a mission the way an autopilot executes them, and notes every leg.
//!
//! From each place the items after it are walked, along every branch that a jump makes, until the
//! next places. A walk visits an item at most once for each way that the vehicle can be there, so
//! that loops end; the number of steps is bounded for missions that are made to be hostile.

use std::collections::HashSet;

use super::Mission;
use super::altitude::Altitude;
use super::autopilot::Autopilot;
use super::commands::{Destination, LoiterHabit, Role, loiter_radius};
use super::curve::{arc_bound, spline_bound};
use super::insertion::insertion_point;
use super::item::{Command, Frame, MissionItem};
use super::jumps::Jumps;
use super::legs::{
    FlightContext, Leg, LegEnd, LegError, LegKind, LegShape, LegWarning, MissionLegs, ReturnTo,
};
use crate::geodesy::LatLon;
use crate::units::Metres;

/// The most legs, and the most steps for each of them on average, that a mission may take.
const LEG_LIMIT: usize = 100_000;
const STEP_LIMIT: usize = 40 * LEG_LIMIT;

/// Whether the vehicle can fly on to a waypoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Status {
    /// Before the first place or takeoff.
    Before,
    Flying,
    Landed,
}

/// A return that goes on in a landing sequence: the item that returned and where waypoints for it
/// go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Landing {
    entry: usize,
    insert_before: Option<usize>,
}

/// Where a walk is: the vehicle's state as execution arrives at an item.
#[derive(Debug, Clone, Copy)]
struct State {
    index: usize,
    /// The last item of navigation.
    navigation: Option<usize>,
    position: Option<LatLon>,
    altitude: Option<Altitude>,
    circle: Metres,
    status: Status,
    jump: Option<usize>,
    landing: Option<Landing>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct StateKey {
    index: usize,
    jumped: bool,
    status: Status,
    position: Option<[u64; 2]>,
    circle: u64,
    landing: Option<usize>,
}

fn bits(position: LatLon) -> [u64; 2] {
    [position.lat().to_bits(), position.lon().to_bits()]
}

impl State {
    fn start(position: Option<LatLon>) -> Self {
        Self {
            index: 0,
            navigation: None,
            position,
            altitude: None,
            circle: Metres::ZERO,
            status: Status::Before,
            jump: None,
            landing: None,
        }
    }

    fn after(item: usize, position: LatLon) -> Self {
        Self {
            index: item + 1,
            navigation: Some(item),
            status: Status::Flying,
            ..Self::start(Some(position))
        }
    }

    /// What tells apart the ways of being at an item within one walk.
    fn key(&self) -> StateKey {
        StateKey {
            index: self.index,
            jumped: self.jump.is_some(),
            status: self.status,
            position: self.position.map(bits),
            circle: self.circle.0.to_bits(),
            landing: self.landing.map(|landing| landing.entry),
        }
    }

    fn end(&self, position: LatLon) -> LegEnd {
        LegEnd { item: self.navigation, position, altitude: self.altitude, circle: self.circle }
    }
}

/// The mission as it is walked.
struct Itinerary<'a> {
    items: &'a [MissionItem],
    context: &'a FlightContext<'a>,
    /// The place of each item that has one.
    places: Vec<Option<LatLon>>,
    radii: Vec<Metres>,
    jumps: Jumps,
    homes: Vec<LatLon>,
    known_homes: HashSet<[u64; 2]>,
    /// A `DO_SET_HOME` at a place that is not known was passed.
    home_lost: bool,
    landings: Vec<usize>,
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
        homes: home.into_iter().collect(),
        known_homes: home.into_iter().map(bits).collect(),
        home_lost: false,
        landings: landings.collect(),
        steps: 0,
        legs: Vec::new(),
    };
    let start = State::start(context.start.or(home));
    // The first pass finds where home is moved to; the returns of the second need all of that.
    itinerary.walk_all(start)?;
    itinerary.legs.clear();
    itinerary.walk_all(start)?;
    itinerary.stay_at_places_without_legs();
    warnings.extend(items.iter().enumerate().filter_map(warning));
    warnings.sort_by_key(|warning| warning.item());
    Ok(MissionLegs { legs: itinerary.legs, warnings })
}

impl Itinerary<'_> {
    fn walk_all(&mut self, start: State) -> Result<(), LegError> {
        let mut taken_off: HashSet<usize> = self.walk(start)?.into_iter().collect();
        for item in 0..self.items.len() {
            let role = self.items[item].command.role();
            match (role, self.places[item]) {
                (Role::Place(destination), Some(place)) => {
                    let takeoff = destination == Destination::Takeoff;
                    // ArduPilot never is at a takeoff's own place once it can be elsewhere.
                    let elsewhere = self.context.autopilot == Autopilot::ArduPilot;
                    if takeoff && elsewhere && taken_off.contains(&item) {
                        continue;
                    }
                    taken_off.extend(self.walk(self.departure(item, destination, place))?);
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

    /// Walks from a state to the next places along every branch. Returns the takeoffs that were
    /// passed where the vehicle was instead of at their own place.
    fn walk(&mut self, from: State) -> Result<Vec<usize>, LegError> {
        let mut passed = Vec::new();
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
                Role::Jump | Role::TagJump => {
                    open.push(next);
                    let jump = state.jump.or(Some(index));
                    let destinations = self.jumps.destinations(index);
                    open.extend(destinations.iter().map(|&index| State { index, jump, ..state }));
                    self.count(destinations.len())?;
                }
                Role::PathNotGiven => {
                    return Err(LegError::PathNotGiven { item: index, command: item.command });
                }
                Role::Hold => open.push(State { navigation: Some(index), ..next }),
                Role::Return => self.fly_back(state, &mut open)?,
                Role::Place(Destination::Takeoff) => {
                    if let Some(on) = self.take_off(state)? {
                        passed.push(index);
                        open.push(on);
                    }
                }
                Role::Place(destination) => open.extend(self.arrive(state, destination)?),
            }
        }
        Ok(passed)
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
            (Some(place), Autopilot::ArduPilot) => state.position.or(Some(place)),
            (Some(_), Autopilot::Px4) => return Ok(None),
            (Some(place), Autopilot::Unknown) => match state.position {
                Some(from) if from.to_e7() != place.to_e7() => state.position,
                _ => return Ok(None),
            },
        };
        Ok(Some(State {
            index: index + 1,
            navigation: Some(index),
            position,
            altitude: self.altitude(index, Destination::Takeoff),
            circle: Metres::ZERO,
            status: Status::Flying,
            ..state
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
            if state.status == Status::Flying {
                let from = self.leave(&state)?;
                let to = to(place, self.altitude(index, destination));
                let shape = self.shape(destination, &from, &to);
                self.push(&state, from, to, LegKind::Flown, shape)?;
            }
            return Ok(None);
        }
        let on = State { index: index + 1, navigation: Some(index), ..state };
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
        if state.status != Status::Flying || state.landing.is_some() {
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
        match state.jump {
            None => insertion_point(self.items, &self.jumps, first, end),
            Some(_) => None,
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
                Some(landing) => landing.insert_before.filter(|_| state.jump.is_none()),
                None => self.insertion(state, state.index),
            },
            _ => None,
        };
        let kind = match (kind, state.landing) {
            (LegKind::Flown, Some(l)) => LegKind::Return(ReturnTo::LandingSequence(l.entry)),
            _ => kind,
        };
        self.legs.push(Leg { from, to, kind, shape, jump: state.jump, insert_before });
        Ok(())
    }

    /// Every place is judged, also one that no leg touches.
    fn stay_at_places_without_legs(&mut self) {
        let mut touched = vec![false; self.items.len()];
        for leg in &self.legs {
            for item in [leg.from.item, leg.to.item].into_iter().flatten() {
                touched[item] = true;
            }
        }
        for (item, _) in touched.iter().enumerate().filter(|(_, touched)| !**touched) {
            let (Role::Place(destination), Some(position)) =
                (self.items[item].command.role(), self.places[item])
            else {
                continue;
            };
            let altitude = self.altitude(item, destination);
            let end = LegEnd { item: Some(item), position, altitude, circle: self.radii[item] };
            self.legs.push(Leg {
                from: end,
                to: end,
                kind: LegKind::Stay,
                shape: LegShape::Straight,
                jump: None,
                insert_before: None,
            });
        }
    }

    fn shape(&self, destination: Destination, from: &LegEnd, to: &LegEnd) -> LegShape {
        let item = to.item.map(|item| &self.items[item]);
        match (destination, item) {
            (Destination::Spline, _) => LegShape::Curved { within: spline_bound(from, to) },
            (Destination::Arc, Some(item)) => {
                LegShape::Curved { within: arc_bound(f64::from(item.params[0]), from, to) }
            }
            _ => LegShape::Straight,
        }
    }
}

/// The places of the items; the items whose place matters to the path must have a valid one.
fn places(items: &[MissionItem]) -> Result<Vec<Option<LatLon>>, LegError> {
    items.iter().enumerate().map(place).collect()
}

fn place((index, item): (usize, &MissionItem)) -> Result<Option<LatLon>, LegError> {
    let here = item.x == 0 && item.y == 0;
    match item.command.role() {
        Role::SetHome if item.params[0] == 1.0 => return Ok(None),
        Role::Place(_) | Role::SetHome => {}
        _ => return Ok(None),
    }
    // Zero is "here" where it is latitude and longitude or nothing; elsewhere it is a place.
    if here && (item.frame.is_global() || item.frame == Frame::MISSION) {
        return Ok(None);
    }
    if !item.frame.is_global() {
        return Err(LegError::Frame { item: index, frame: item.frame });
    }
    item.position().map(Some).map_err(|source| LegError::Position { item: index, source })
}

/// The loiter radii of the items, zero where there is none, and which had to be guessed.
fn radii(
    items: &[MissionItem],
    habit: LoiterHabit,
) -> Result<(Vec<Metres>, Vec<LegWarning>), LegError> {
    let mut warnings = Vec::new();
    let radius = |(index, item): (usize, &MissionItem)| {
        if item.command.role() != Role::Place(Destination::Loiter) {
            return Ok(Metres::ZERO);
        }
        let radius = loiter_radius(item, habit).unwrap_or_else(|| {
            warnings.push(LegWarning::LoiterRadius { item: index });
            Metres::ZERO
        });
        if radius.0.is_finite() { Ok(radius) } else { Err(LegError::Radius { item: index }) }
    };
    let radii = items.iter().enumerate().map(radius).collect::<Result<_, _>>()?;
    Ok((radii, warnings))
}

fn warning((index, item): (usize, &MissionItem)) -> Option<LegWarning> {
    match item.command.role() {
        Role::Place(Destination::Unknown) => {
            Some(LegWarning::UnknownNavigation { item: index, command: item.command })
        }
        Role::Unknown => Some(LegWarning::UnknownCommand { item: index, command: item.command }),
        Role::Entry => Some(LegWarning::EnteredFromAnywhere { item: index }),
        _ => None,
    }
}
