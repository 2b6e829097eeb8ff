//! What a vehicle's parameters say about its fence: whether the drawn areas are enforced, what
//! several inclusions mean together, and the limits that no fence item shows (the circle around
//! home, the lowest and highest altitude).
//!
//! Pure: a function from parameter names to values in, [`VehicleRules`] out.
//!
//! | ArduPilot (`AC_Fence`) | here |
//! |---|---|
//! | `FENCE_ENABLE`, `FENCE_AUTOENABLE`, `FENCE_TYPE` bit 2 | [`Enforcement`] of the drawn areas |
//! | `FENCE_OPTIONS` bit 1 | [`InclusionRule::Any`], else [`InclusionRule::All`] |
//! | `FENCE_RADIUS` with `FENCE_TYPE` bit 1 | [`Limits::radius`] |
//! | `FENCE_ALT_MAX`, `_ALT_MIN` with bits 0 and 3 | [`Limits::ceiling`], [`Limits::floor`] |
//! | `FENCE_MARGIN` | [`VehicleRules::margin`] |
//!
//! | PX4 (`Geofence`) | here |
//! |---|---|
//! | `GF_ACTION` 0 (none) | the drawn areas are not enforced |
//! | `GF_MAX_HOR_DIST`, `GF_MAX_VER_DIST`, 0 for none | [`Limits::radius`], [`Limits::ceiling`] |
//!
//! Decisions, each on the side of fewer places to fly:
//!
//! - Areas that a pilot drew count whether they are enforced or not, unless asked otherwise.
//!   ArduPilot's limits count only while they are enforced: they have values (300 m, 100 m) on
//!   every vehicle, which nobody chose. PX4's are off by default, so that a set one was chosen and
//!   counts whatever `GF_ACTION` is.
//! - ArduPilot breaches at the fence itself, not at `FENCE_MARGIN` before it
//!   (`AC_Fence::check_fence_alt_max`, `check_fence_circle`, `AC_PolyFence_loader::breached`); the
//!   margin is "the distance that autopilots should maintain from the fence to avoid a breach". That
//!   is what the buffer is, so that the larger of the two is kept, not their sum. For altitudes,
//!   which quavd does not change, the margin is worth a warning.
//! - PX4 takes the intersection of its inclusions and leaves out those that do not have home
//!   inside; here they all count.

use std::fmt;
use std::str::FromStr;

use super::{FenceRegion, FenceRole, FenceSet, FenceShape};
use crate::geodesy::LatLon;
use crate::mission::Autopilot;
use crate::units::Metres;

/// What several inclusion regions mean together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum InclusionRule {
    /// Inside all of them, as ArduPilot (without the union option) and PX4 do.
    #[default]
    All,
    /// Inside at least one of them.
    Any,
}

impl fmt::Display for InclusionRule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::All => "all",
            Self::Any => "any",
        })
    }
}

impl FromStr for InclusionRule {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "all" => Ok(Self::All),
            "any" => Ok(Self::Any),
            _ => Err(format!("'{text}' is neither all nor any")),
        }
    }
}

/// Whether the vehicle itself acts on its drawn fence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Enforcement {
    /// A parameter that decides it is not known.
    #[default]
    Unknown,
    /// Some breach of it has consequences.
    On,
    /// It is switched off.
    Off,
}

/// A limit that a parameter sets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// The parameter.
    pub parameter: &'static str,
    /// Its value: a distance from home, or metres above home.
    pub metres: Metres,
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({} m)", self.parameter, self.metres.0)
    }
}

/// The limits around home that apply to a mission besides its fences.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Limits {
    /// The vehicle must stay nearer to home than this.
    pub radius: Option<Limit>,
    /// It must stay lower above home than this.
    pub ceiling: Option<Limit>,
    /// It must stay higher above home than this, once it has taken off.
    pub floor: Option<Limit>,
    /// How near to an altitude limit is worth a warning.
    pub margin: Metres,
}

impl Limits {
    /// Whether there is any.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.radius.is_none() && self.ceiling.is_none() && self.floor.is_none()
    }

    /// The circle around home, as a region to stay inside.
    #[must_use]
    pub fn circle(&self, home: LatLon) -> Option<FenceRegion> {
        self.radius.map(|limit| FenceRegion {
            role: FenceRole::Inclusion,
            shape: FenceShape::Circle { centre: home, radius: limit.metres },
            heights: None,
            origin: format!("the circle of {limit} around home"),
        })
    }
}

/// What a vehicle's parameters say.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct VehicleRules {
    /// Whether they are those of PX4.
    px4: bool,
    /// Whether the drawn areas are enforced.
    pub drawn: Enforcement,
    /// What several inclusions mean together, where that is known.
    pub inclusion: Option<InclusionRule>,
    /// What the vehicle itself wants to keep from its fence.
    pub margin: Option<Metres>,
    /// The limits around home.
    pub limits: Limits,
    /// The radius that a fixed wing circles with where an item gives none.
    pub loiter_radius: Option<Metres>,
    /// The radius of a multirotor's `NAV_LOITER_TURNS` where the item gives none.
    pub circle_radius: Option<Metres>,
    /// What was found, in words: a sentence each.
    pub applied: Vec<String>,
    /// Parameters that matter and that the vehicle does not have or that make no sense.
    pub missing: Vec<String>,
}

const ARDUPILOT: [&str; 12] = [
    "FENCE_ENABLE",
    "FENCE_AUTOENABLE",
    "FENCE_TYPE",
    "FENCE_OPTIONS",
    "FENCE_MARGIN",
    "FENCE_RADIUS",
    "FENCE_ALT_MAX",
    "FENCE_ALT_MIN",
    "WP_LOITER_RAD",
    "CIRCLE_RADIUS_M",
    "CIRCLE_RADIUS",
    "RTL_RADIUS",
];
const PX4: [&str; 4] = ["GF_ACTION", "GF_MAX_HOR_DIST", "GF_MAX_VER_DIST", "NAV_LOITER_RAD"];

/// The most that any distance of a parameter is believed to be, metres.
const FARTHEST: f64 = super::items::MAX_RADIUS;

impl VehicleRules {
    /// The parameters that are looked at.
    #[must_use]
    pub fn parameters(autopilot: Autopilot) -> &'static [&'static str] {
        match autopilot {
            Autopilot::ArduPilot => &ARDUPILOT,
            Autopilot::Px4 => &PX4,
            Autopilot::Unknown => &[],
        }
    }

    /// Takes the areas of the vehicle's own fence out where it has switched them off, and says so.
    #[must_use]
    pub fn leave_out_disabled(&self, fences: &mut FenceSet) -> Option<String> {
        let areas = fences.regions.len();
        match self.drawn {
            Enforcement::Off if areas > 0 => {
                fences.regions.clear();
                Some(format!(
                    "the {areas} areas of the vehicle's fence are left out: it has switched them off"
                ))
            }
            _ => None,
        }
    }

    /// Inclusions that PX4 leaves out because home is not in them. Here they count, so that there
    /// is no way out of home: said so that the refusal is understood.
    #[must_use]
    pub fn odd_inclusions(&self, fences: &FenceSet, home: Option<LatLon>) -> Vec<String> {
        let Some(home) = home.filter(|_| self.px4) else { return Vec::new() };
        let inclusions = fences.regions.iter().filter(|region| region.role == FenceRole::Inclusion);
        inclusions
            .filter(|region| !region.shape.contains(home))
            .map(|region| {
                format!(
                    "{}: home is not inside; PX4 would leave this inclusion out, here it counts",
                    region.origin
                )
            })
            .collect()
    }

    /// The rules from the vehicle's parameters; `value` knows those of
    /// [`VehicleRules::parameters`] that the vehicle has.
    #[must_use]
    pub fn read(autopilot: Autopilot, value: impl Fn(&str) -> Option<f64>) -> Self {
        let mut reading = Reading { value: &value, rules: Self::default() };
        match autopilot {
            Autopilot::ArduPilot => reading.ardupilot(),
            Autopilot::Px4 => reading.px4(),
            Autopilot::Unknown => {
                reading.rules.missing.push(
                    "the parameters of this autopilot are not known: only its drawn fence counts"
                        .to_owned(),
                );
            }
        }
        reading.rules
    }
}

struct Reading<'a> {
    value: &'a dyn Fn(&str) -> Option<f64>,
    rules: VehicleRules,
}

/// Bits of `FENCE_TYPE`.
const MAX_ALTITUDE: u32 = 1;
const HOME_CIRCLE: u32 = 2;
const POLYGONS: u32 = 4;
const MIN_ALTITUDE: u32 = 8;
/// The bit of `FENCE_OPTIONS` that joins inclusions.
const UNION: u32 = 2;

impl Reading<'_> {
    fn get(&self, name: &str) -> Option<f64> {
        (self.value)(name).filter(|value| value.is_finite())
    }

    /// A parameter that should be there.
    fn expect(&mut self, name: &str, otherwise: &str) -> Option<f64> {
        let value = self.get(name);
        if value.is_none() {
            self.rules.missing.push(format!("{name} is not known: {otherwise}"));
        }
        value
    }

    fn bits(&mut self, name: &str, otherwise: &str) -> Option<u32> {
        let value = self.expect(name, otherwise)?;
        // Within u32 and whole: the cast is exact.
        if value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&value) {
            return Some(value as u32);
        }
        self.rules.missing.push(format!("{name} is {value}, which is no set of bits: {otherwise}"));
        None
    }

    /// A distance that limits something; one that makes no sense is said and does not count.
    fn limit(&mut self, name: &'static str, least: f64) -> Option<Limit> {
        let value = self.expect(name, "what it limits is not judged")?;
        if value > least && value <= FARTHEST {
            return Some(Limit { parameter: name, metres: Metres(value) });
        }
        self.rules.missing.push(format!("{name} is {value} m, which limits nothing"));
        None
    }

    fn apply(&mut self, what: String) {
        self.rules.applied.push(what);
    }

    fn radius_of(&self, name: &str, scale: f64) -> Option<Metres> {
        let radius = self.get(name)?.abs() * scale;
        (radius > 0.0 && radius <= FARTHEST).then_some(Metres(radius))
    }

    fn ardupilot(&mut self) {
        let otherwise = "the drawn fence counts; the limits around home are not judged";
        let enabled = self.expect("FENCE_ENABLE", otherwise);
        // Not on every vehicle and version: none is off.
        let auto = self.get("FENCE_AUTOENABLE").unwrap_or(0.0);
        let kinds = self.bits("FENCE_TYPE", otherwise);
        let on = enabled.map(|enabled| enabled != 0.0 || auto != 0.0);
        let has = |bit: u32| kinds.map(|kinds| kinds & bit != 0);
        self.rules.drawn = match (on, has(POLYGONS)) {
            (Some(false), _) | (_, Some(false)) => Enforcement::Off,
            (Some(true), Some(true)) => Enforcement::On,
            _ => Enforcement::Unknown,
        };
        match (on, self.rules.drawn) {
            (Some(false), _) => self.apply(
                "the fence is switched off (FENCE_ENABLE 0): its altitude limits and its circle \
                 around home do not count"
                    .to_owned(),
            ),
            (_, Enforcement::Off) => {
                self.apply("FENCE_TYPE leaves the drawn areas out: bit 2 is not set".to_owned());
            }
            _ => {}
        }

        let union = self.get("FENCE_OPTIONS").is_some_and(|options| {
            options.fract() == 0.0 && options >= 0.0 && (options as u32) & UNION != 0
        });
        // Without the parameter (before 4.3) there is no union.
        let rule = if union { InclusionRule::Any } else { InclusionRule::All };
        self.rules.inclusion = Some(rule);
        if union {
            self.apply("inside any of the inclusion areas (FENCE_OPTIONS bit 1)".to_owned());
        }
        self.rules.margin = self
            .expect("FENCE_MARGIN", "only the buffer is kept")
            .and_then(|m| (m > 0.0 && m <= FARTHEST).then_some(Metres(m)));
        self.rules.limits.margin = self.rules.margin.unwrap_or(Metres::ZERO);

        if on == Some(true) {
            if has(HOME_CIRCLE) == Some(true) {
                self.rules.limits.radius = self.limit("FENCE_RADIUS", 0.0);
            }
            if has(MAX_ALTITUDE) == Some(true) {
                self.rules.limits.ceiling = self.limit("FENCE_ALT_MAX", 0.0);
            }
            if has(MIN_ALTITUDE) == Some(true) {
                self.rules.limits.floor = self.limit("FENCE_ALT_MIN", -FARTHEST);
            }
        }
        self.say_limits();
        // A fixed wing returns with RTL_RADIUS where that is set; the larger circle is judged.
        let wide = self.radius_of("RTL_RADIUS", 1.0).unwrap_or(Metres::ZERO);
        self.rules.loiter_radius = self.radius_of("WP_LOITER_RAD", 1.0).map(|r| r.max(wide));
        // In centimetres before 4.7, which calls it CIRCLE_RADIUS_M.
        self.rules.circle_radius = self
            .radius_of("CIRCLE_RADIUS_M", 1.0)
            .or_else(|| self.radius_of("CIRCLE_RADIUS", 0.01));
    }

    fn px4(&mut self) {
        self.rules.px4 = true;
        self.rules.inclusion = Some(InclusionRule::All);
        let action = self.expect("GF_ACTION", "the drawn fence counts");
        self.rules.drawn = match action {
            None => Enforcement::Unknown,
            Some(0.0) => Enforcement::Off,
            Some(_) => Enforcement::On,
        };
        if self.rules.drawn == Enforcement::Off {
            self.apply("PX4 does nothing at a breach of its fence (GF_ACTION 0)".to_owned());
        }
        let set = |reading: &mut Self, name: &'static str| match reading.get(name) {
            Some(0.0) => None,
            _ => reading.limit(name, 0.0),
        };
        self.rules.limits.radius = set(self, "GF_MAX_HOR_DIST");
        self.rules.limits.ceiling = set(self, "GF_MAX_VER_DIST");
        self.say_limits();
        self.rules.loiter_radius = self.radius_of("NAV_LOITER_RAD", 1.0);
    }

    fn say_limits(&mut self) {
        let Limits { radius, ceiling, floor, .. } = self.rules.limits;
        if let Some(limit) = radius {
            self.apply(format!("inside the circle of {limit} around home"));
        }
        if let Some(limit) = ceiling {
            self.apply(format!("below {limit} above home"));
        }
        if let Some(limit) = floor {
            self.apply(format!("above {limit} above home"));
        }
    }
}

#[cfg(test)]
mod tests;
