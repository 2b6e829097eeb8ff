//! Integration tests, one binary. [`sitl`] starts the fake vehicle; the other modules are one
//! user-visible promise each.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout)]

mod bad_links;
mod campaign;
mod certificates;
mod commands;
mod compare;
mod daemon;
mod deadline;
mod docs;
mod fuzz;
mod ibm_circuits;
mod in_flight;
mod limits;
mod loaders;
mod packaging;
mod page;
mod parameters;
mod plan_files;
mod reference;
mod replacing;
mod scenes;
mod security;
mod sitl;
mod terminal;
mod transfers;
mod windows;
