//! Reading the vehicle's parameters (MAVLink parameter protocol, "Read Single Parameter").
//!
//! Most autopilots do not answer a question for a name that they do not know, and on a bad link
//! they do not seem to answer for one that they do know either. So with every round of questions
//! goes one that each vehicle can answer, for its first parameter: how often that one comes back
//! tells how much the silence about a name is worth. What a vehicle was found not to have costs
//! that time once: from then on it is asked for with the others, and they alone are waited for.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{MutexGuard, PoisonError};
use std::time::Duration;

use tokio::time::{Instant, timeout_at};

use super::Vehicle;
use super::discovery::Autopilot;
use crate::link::message::{ParamError, ParamName, ParamRequestRead, ParamValue, StatusText};
use crate::link::{Inbox, LinkError, Received};

/// ArduPilot keeps no more questions than this (`GCS_MAVLINK::param_requests` holds 20 on the
/// smallest boards); what is more waits for the next round.
const MOST_AT_ONCE: usize = 16;
/// How sure silence must make that there is no such parameter: the chance that all answers for it
/// were lost.
const MOST_DOUBT: f64 = 1e-4;

/// The value of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParameterValue {
    /// Of an integer type.
    Integer(i64),
    /// Of a floating-point type; finite.
    Real(f32),
}

impl ParameterValue {
    /// As a floating-point number.
    #[must_use]
    pub fn as_f64(self) -> f64 {
        match self {
            // All integer types that travel in a PARAM_VALUE have at most 32 bits.
            Self::Integer(value) => value as f64,
            Self::Real(value) => f64::from(value),
        }
    }

    /// As an integer: of an integer type, or a whole number.
    #[must_use]
    pub fn as_integer(self) -> Option<i64> {
        match self {
            Self::Integer(value) => Some(value),
            Self::Real(value) if value.fract() == 0.0 && value.abs() < 1e9 => Some(value as i64),
            Self::Real(_) => None,
        }
    }
}

/// Why a parameter could not be read.
#[derive(Debug, Clone, thiserror::Error)]
pub enum ParameterError {
    /// The link is gone.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// That is no name a parameter can have.
    #[error("{name:?} is no parameter name: 1 to 16 letters, digits and underscores")]
    Name {
        /// What was given.
        name: String,
    },
    /// It does not answer, or so rarely that its silence proves nothing.
    #[error(
        "the vehicle did not tell its parameter {name} for {:.0} s; see that it is on and in \
         range, then try again",
        waited.as_secs_f64()
    )]
    NoAnswer {
        /// Which.
        name: ParamName,
        /// How long it was waited for.
        waited: Duration,
    },
    /// The value is one that no parameter has.
    #[error("the vehicle's parameter {name} is {what}; set it with a ground station")]
    Value {
        /// Which.
        name: ParamName,
        /// What is wrong with it.
        what: &'static str,
    },
}

impl Vehicle {
    /// Reads one parameter; `None` where the vehicle does not have it.
    ///
    /// # Errors
    /// [`ParameterError`].
    pub async fn parameter(&self, name: &str) -> Result<Option<ParameterValue>, ParameterError> {
        Ok(self.parameters(&[name]).await?.pop().flatten())
    }

    /// Reads several parameters, in the order of the names; `None` where the vehicle does not have
    /// one. Unknown names cost their patience together, not one after the other.
    ///
    /// # Errors
    /// [`ParameterError`].
    pub async fn parameters(
        &self,
        names: &[&str],
    ) -> Result<Vec<Option<ParameterValue>>, ParameterError> {
        let names: Vec<ParamName> = names
            .iter()
            .map(|&name| {
                ParamName::new(name).ok_or_else(|| ParameterError::Name { name: name.to_owned() })
            })
            .collect::<Result<_, _>>()?;
        let inbox = self.link.subscribe()?;
        // What it did not have before is asked for, and not waited for once the others have come.
        let doubtful = self.doubtful(&names);
        let mut reading =
            Reading { vehicle: self, inbox, known: BTreeMap::new(), doubtful, proofs: 0 };
        reading.run(&names).await?;
        let mut lacked = self.lacked();
        for name in &names {
            match reading.known.get(name).copied().flatten() {
                Some(_) => lacked.remove(name),
                None => lacked.insert(*name),
            };
        }
        Ok(names.iter().map(|name| reading.known.get(name).copied().flatten()).collect())
    }

    /// Those of the names that it was found not to have, where there are others to be waited for.
    fn doubtful(&self, names: &[ParamName]) -> BTreeSet<ParamName> {
        let lacked = self.lacked();
        if names.iter().all(|name| lacked.contains(name)) {
            return BTreeSet::new();
        }
        let doubtful = names.iter().filter(|&name| lacked.contains(name)).copied();
        doubtful.take(MOST_AT_ONCE / 2).collect()
    }

    fn lacked(&self) -> MutexGuard<'_, BTreeSet<ParamName>> {
        self.lacked.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// One run of questions.
struct Reading<'a> {
    vehicle: &'a Vehicle,
    inbox: Inbox,
    /// What is settled.
    known: BTreeMap<ParamName, Option<ParameterValue>>,
    /// What the vehicle did not have when it was asked before.
    doubtful: BTreeSet<ParamName>,
    /// Rounds in which the question that each vehicle can answer was answered.
    proofs: u32,
}

impl Reading<'_> {
    async fn run(&mut self, names: &[ParamName]) -> Result<(), ParameterError> {
        let began = Instant::now();
        // How often each name was asked for.
        let mut asked: BTreeMap<ParamName, u32> = BTreeMap::new();
        let mut rounds = 0;
        loop {
            let mut open: Vec<ParamName> = Vec::new();
            for &name in names {
                let is_settled = self.known.contains_key(&name) || self.doubtful.contains(&name);
                if !is_settled && !open.contains(&name) {
                    open.push(name);
                }
            }
            // Those that were asked for least come first.
            open.sort_by_key(|name| asked.get(name).copied().unwrap_or(0));
            open.truncate(MOST_AT_ONCE - self.doubtful.len());
            let Some(&first) = open.first() else { return Ok(()) };
            let patience = self.vehicle.timing.patience;
            let is_gone = self.vehicle.silent_for() >= patience;
            if rounds > 0 && (is_gone || began.elapsed() >= 2 * patience) {
                let waited = began.elapsed();
                return Err(ParameterError::NoAnswer { name: first, waited });
            }
            if rounds == 0 {
                // Answers come in the order of the questions: with the last of the others, these
                // are there as well.
                for &name in &self.doubtful {
                    self.ask(-1, name).await?;
                }
            }
            for &name in &open {
                self.ask(-1, name).await?;
                *asked.entry(name).or_default() += 1;
            }
            self.ask(0, first).await?;
            rounds += 1;
            self.listen(&open).await?;
            self.give_up_on(&open, &asked, rounds);
        }
    }

    async fn ask(&self, index: i16, name: ParamName) -> Result<(), LinkError> {
        self.vehicle.link.send(&ParamRequestRead { target: self.vehicle.node, index, name }).await
    }

    /// Takes in answers until all are there or the round is over.
    async fn listen(&mut self, open: &[ParamName]) -> Result<(), ParameterError> {
        let deadline = Instant::now() + self.vehicle.timing.parameter;
        let mut proven = false;
        while open.iter().any(|name| !self.known.contains_key(name)) {
            let Ok(received) = timeout_at(deadline, self.inbox.next()).await else { break };
            let received = received?;
            if received.from != self.vehicle.node {
                continue;
            }
            if let Some(value) = received.decode::<ParamValue>() {
                if value.index == 0 && !proven {
                    proven = true;
                    self.proofs += 1;
                }
                if open.contains(&value.name) || self.doubtful.contains(&value.name) {
                    let read = value_of(&value, self.vehicle.copies_bytes())?;
                    self.known.insert(value.name, Some(read));
                }
            } else if let Some(name) = self.unknown(&received, open) {
                self.known.entry(name).or_insert(None);
            }
        }
        Ok(())
    }

    /// The name that the vehicle says it does not know: in a PARAM_ERROR, or PX4 in words.
    fn unknown(&self, received: &Received, open: &[ParamName]) -> Option<ParamName> {
        if let Some(error) = received.decode::<ParamError>() {
            let is_answer = error.target == self.vehicle.link.node()
                && error.error == ParamError::DOES_NOT_EXIST
                && open.contains(&error.name);
            return is_answer.then_some(error.name);
        }
        let text = received.decode::<StatusText>()?;
        let text = String::from_utf8_lossy(&text.text);
        let name = text.trim_end_matches('\0').strip_prefix("[pm] unknown param: ")?;
        let name = ParamName::new(name)?;
        (self.vehicle.autopilot == Autopilot::Px4 && open.contains(&name)).then_some(name)
    }

    /// Settles the names whose silence has become proof enough.
    fn give_up_on(&mut self, open: &[ParamName], asked: &BTreeMap<ParamName, u32>, rounds: u32) {
        // Laplace's rule of succession: never surer than the number of rounds allows.
        let answered = f64::from(self.proofs) / f64::from(rounds + 1);
        for &name in open {
            let times = asked.get(&name).copied().unwrap_or(0);
            let doubt = (1.0 - answered).powi(i32::try_from(times).unwrap_or(i32::MAX));
            if doubt <= MOST_DOUBT && !self.known.contains_key(&name) {
                tracing::debug!(%name, times, "the vehicle does not have this parameter");
                self.known.insert(name, None);
            }
        }
    }
}

impl Vehicle {
    /// How integers travel in the four bytes of a float: PX4 copies the bytes, ArduPilot converts
    /// the number. Others tell by a capability, and convert where they do not.
    fn copies_bytes(&self) -> bool {
        match self.autopilot {
            Autopilot::Px4 => true,
            Autopilot::ArduPilot => false,
            Autopilot::Other(_) => {
                self.capabilities.is_some_and(super::Capabilities::copies_parameter_bytes)
            }
        }
    }
}

/// The value in a PARAM_VALUE.
fn value_of(value: &ParamValue, copies_bytes: bool) -> Result<ParameterValue, ParameterError> {
    /// `MAV_PARAM_TYPE`s of integers with at most 32 bits: UINT8 to INT32.
    const INTEGERS: std::ops::RangeInclusive<u8> = 1..=6;
    const REAL32: u8 = 9;
    let name = value.name;
    let refuse = |what| Err(ParameterError::Value { name, what });
    let number = f32::from_bits(value.bits);
    match value.kind {
        REAL32 if number.is_finite() => Ok(ParameterValue::Real(number)),
        kind if INTEGERS.contains(&kind) && copies_bytes => {
            Ok(ParameterValue::Integer(integer_in(kind, value.bits)))
        }
        kind if INTEGERS.contains(&kind) && number.is_finite() => {
            if number.abs() > u32::MAX as f32 {
                return refuse("out of the range of its type");
            }
            Ok(ParameterValue::Integer(number.round() as i64))
        }
        REAL32 | 1..=6 => refuse("not a number"),
        _ => refuse("of a type that does not fit a PARAM_VALUE"),
    }
}

/// The integer whose bytes are at the beginning of `bits`.
fn integer_in(kind: u8, bits: u32) -> i64 {
    let [a, b, ..] = bits.to_le_bytes();
    match kind {
        1 => i64::from(a),
        2 => i64::from(a.cast_signed()),
        3 => i64::from(u16::from_le_bytes([a, b])),
        4 => i64::from(i16::from_le_bytes([a, b])),
        5 => i64::from(bits),
        _ => i64::from(bits.cast_signed()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(kind: u8, bits: u32) -> ParamValue {
        let name = ParamName::new("X").unwrap();
        ParamValue { bits, count: 1, index: 0, name, kind }
    }

    #[test]
    fn an_integer_is_converted_by_ardupilot_and_copied_by_px4() {
        let minus_two = (-2_i32).cast_unsigned();
        for (kind, bits, copies_bytes, expected) in [
            (6, (-2.0_f32).to_bits(), false, -2),
            (6, minus_two, true, -2),
            (2, 3.0_f32.to_bits(), false, 3),
            (2, 0x0000_00fe, true, -2),
            (4, 0x0000_fffe, true, -2),
            (1, 0x0000_00fe, true, 254),
            (3, 0x0000_fffe, true, 65_534),
            (5, u32::MAX, true, 4_294_967_295),
        ] {
            let read = value_of(&value(kind, bits), copies_bytes).unwrap();
            assert_eq!(read, ParameterValue::Integer(expected), "{kind} {bits:#x}");
        }
        let real = value_of(&value(9, 1.5_f32.to_bits()), true).unwrap();
        assert_eq!(real, ParameterValue::Real(1.5));
        assert_eq!((real.as_integer(), real.as_f64()), (None, 1.5));
        assert_eq!(ParameterValue::Real(-3.0).as_integer(), Some(-3));
    }

    #[test]
    fn what_is_no_number_is_an_error() {
        for (kind, bits) in [
            (9, f32::NAN.to_bits()),
            (9, f32::INFINITY.to_bits()),
            (6, f32::NAN.to_bits()),
            (6, 1e30_f32.to_bits()),
            (7, 0),
            (0, 0),
            (255, 0),
        ] {
            assert!(value_of(&value(kind, bits), false).is_err(), "{kind} {bits:#x}");
        }
        assert!(value_of(&value(9, f32::NAN.to_bits()), true).is_err());
    }
}
