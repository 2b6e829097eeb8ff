//! What a path is tested against: fences as planar barriers in ground metres, with an index.
//!
//! - [`outline`]: one fence region made planar; unusable ones are errors, odd ones walls;
//! - `long_edges`: what programs disagree about in the middle of edges of kilometres;
//! - [`barrier`]: segments and discs, their distances, and the spatial index over them;
//! - [`space`]: the [`Airspace`]: clearance and side tests for segments;
//! - [`buffered`]: the regions grown (or shrunk) by the buffer, as polygons.
//!
//! All coordinates are those of one [`crate::geodesy::LocalFrame`]. Whether a segment is clear is
//! always decided by exact distances to the unbuffered outlines; the buffered polygons are for
//! pictures and for proving that there is no way through.

pub mod barrier;
pub mod buffered;
mod long_edges;
pub mod outline;
mod slabs;
pub mod space;

pub use outline::{AirspaceError, Outline, RegionProblem};
pub use space::{Airspace, RegionId};
