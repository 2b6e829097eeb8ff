//! A vehicle's rules, read from its parameters: what [`VehicleRules`] is made from, and how the
//! vehicle loiters.

use std::collections::HashMap;

use super::Vehicle;
use super::parameter::ParameterError;
use crate::fence::VehicleRules;
use crate::mission::{self, LoiterHabit};

impl Vehicle {
    /// Reads the parameters that say what the vehicle's fence forbids and how it loiters. What it
    /// does not have is in [`VehicleRules::missing`].
    ///
    /// # Errors
    /// [`ParameterError`] where it does not answer: nothing is then known of its limits.
    pub async fn rules(&self) -> Result<(VehicleRules, LoiterHabit), ParameterError> {
        let autopilot: mission::Autopilot = self.autopilot().into();
        let names = VehicleRules::parameters(autopilot);
        let values = self.parameters(names).await?;
        let known: HashMap<&str, f64> = names
            .iter()
            .zip(values)
            .filter_map(|(&name, value)| Some((name, value?.as_f64())))
            .collect();
        let rules = VehicleRules::read(autopilot, |name| known.get(name).copied());
        let kind = self.state().heartbeat.kind;
        let loiter = LoiterHabit::of(kind, rules.loiter_radius, rules.circle_radius);
        Ok((rules, loiter))
    }
}
