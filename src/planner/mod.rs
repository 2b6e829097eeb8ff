//! QUAV's planner for one leg: candidates, QAOA rounds, finish.
//!
//! In reading order:
//! - [`settings`]: the paper's table of settings and what may be changed;
//! - [`leg_space`]: the airspace with the leg's margins;
//! - [`polyline`]: lengths, turns, simplification;
//! - [`corners`], `sweep`, `pass`, [`search`]: shortest paths over the corners of obstacles;
//! - [`grid`]: the paper's candidate grid;
//! - [`homotopy`]: whether two paths pass obstacles on different sides;
//! - [`candidates`]: structurally different candidates from both;
//! - [`stations`]: segmentation into one edge a qubit;
//! - [`trellis`]: two polylines as an Ising chain;
//! - [`moves`]: challengers for refinement;
//! - [`pair`]: two polylines as problems, in windows where need be;
//! - [`round`]: the record of a round;
//! - [`rounds`]: QAOA decides, round after round;
//! - [`qpu_rounds`]: the same on a QPU, many to a job;
//! - [`finish`]: few waypoints, on the integers that the vehicle flies;
//! - [`enclosure`]: proof that there is no way;
//! - [`leg`]: all of it for one leg.
//!
//! No I/O and no clock but for the timings in the result.

pub mod candidates;
pub mod corners;
pub mod enclosure;
pub mod finish;
pub mod grid;
pub mod homotopy;
pub mod leg;
pub mod leg_space;
pub mod moves;
pub mod pair;
mod pass;
pub mod polyline;
pub mod qpu_rounds;
pub mod round;
pub mod rounds;
pub mod search;
pub mod settings;
pub mod stations;
mod sweep;
pub mod trellis;

pub use leg::{LegOutcome, LegPlan, LegPlanner, PlanError};
pub use settings::{CandidateSource, QpuSettings, QpuTraining, Rounds, Settings};
