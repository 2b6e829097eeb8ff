//! KML: placemarks with polygons, lines and points. What they mean is in [`super::feature`]; pins
//! that say nothing of themselves are no route. Heights are not read. [`read`] and [`write`] hold
//! one direction each.

mod read;
#[cfg(test)]
mod tests;
mod write;

pub(super) use read::read;
pub use write::write_kml;
