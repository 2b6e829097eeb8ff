//! KML
use super::{Scenario, error::*, feature::Want};
pub(super) fn read(_n: &str, _t: &str, _w: Want) -> Result<Scenario, Located> {
    Err(Problem::UnknownFormat.into())
}
/// x
/// # Errors
/// x
pub fn write_kml(_s: &Scenario) -> Result<String, WriteError> {
    Ok(String::new())
}
