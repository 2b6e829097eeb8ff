//! Integration tests, one binary. [`sitl`] starts the fake vehicle; the other modules are one
//! user-visible promise each.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout)]

mod bad_links;
mod campaign;
mod commands;
mod compare;
mod deadline;
mod ibm_circuits;
mod limits;
mod parameters;
mod plan_files;
mod replacing;
mod scenes;
mod security;
mod sitl;
mod transfers;
