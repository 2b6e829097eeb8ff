//! quavd's library: from a vehicle's mission and fences to a verified, re-planned mission.
//!
//! Data goes one way: vehicle → mission and fences → airspace → planner ⇄ QAOA → spliced mission →
//! check → vehicle. In that order:
//!
//! - [`link`]: MAVLink frames over serial, UDP and TCP; quavd as a component;
//! - [`vehicle`]: finding the autopilot, moving plans both ways, proving what it holds;
//! - [`store`]: the original on disk before anything is written;
//! - [`formats`]: the same missions and fences from and to files;
//! - [`mission`], [`fence`]: what was read, as items and regions;
//! - [`geodesy`], [`airspace`]: positions, projections, and barriers in the plane;
//! - [`planner`]: one leg: candidates, QAOA rounds, finish;
//! - [`qaoa`]: Ising problems and the engines that run the circuit;
//! - [`ibm`]: the same circuit on a QPU: line of qubits, native gates, OpenQASM;
//! - [`baseline`]: A* and RRT, to compare with;
//! - [`stop`]: calling all of that off, and its deadline;
//! - [`replan`]: a whole mission, and the judgement of any mission;
//! - [`report`]: what is said and shown about it: JSON, a summary, a picture;
//! - [`config`]: the configuration file `quavd.toml`;
//! - [`daemon`]: staying with a vehicle, and planning when its plans change;
//! - [`cli`]: the commands of `quavd`.

pub mod airspace;
pub mod baseline;
pub mod cli;
pub mod config;
pub mod daemon;
pub mod fence;
pub mod formats;
pub mod geodesy;
pub mod ibm;
pub mod link;
pub mod mission;
pub mod planner;
pub mod qaoa;
pub mod replan;
pub mod report;
pub mod stop;
pub mod store;
pub mod units;
pub mod vehicle;
