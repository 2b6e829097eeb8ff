//! The finish: as few waypoints as needed, on the integers that the vehicle will fly, every edge
//! judged once more against the unsimplified obstacles.

use nalgebra::{Matrix2, Vector2};

use super::leg_space::LegSpace;
use super::polyline::{distance, length, turn};
use crate::airspace::RegionId;
use crate::geodesy::{LatLon, LatLonE7, LocalFrame, ProjectionError, Xy};

/// What all the waypoints that are saved may cost together, as a share of the path's length.
pub const WORTH_OF_FEW: f64 = 4e-4;

/// Turns below this are no corner, radians.
const NO_TURN: f64 = 1e-6;

/// Edges whose directions differ by less than this angle have no meeting point, radians.
const PARALLEL: f64 = 1e-9;

/// Removes what a path does not need: corners that can be cut, and pairs of corners that one can
/// replace, the cheapest first, as long as all of them together cost no more than `share` of
/// the length. Edges stay clear.
#[must_use]
pub fn with_few_corners(path: &[Xy], space: &LegSpace<'_>, share: f64) -> Vec<Xy> {
    let mut path = path.to_vec();
    cut_corners(&mut path, space);
    let mut allowance = share * length(&path);
    // What replacing the corners `k` and `k + 1` by one costs; `None` where that cannot be done.
    let price = |path: &[Xy], k: usize| -> Option<(f64, Xy)> {
        let [a, b, c, d] = *path.get(k.checked_sub(1)?..k + 3)? else { return None };
        let meeting = meeting_point(a, b, c, d)?;
        Some((distance(b, meeting) + distance(meeting, c) - distance(b, c), meeting))
    };
    let mut prices: Vec<_> = (0..path.len()).map(|k| price(&path, k)).collect();
    loop {
        let cheapest = prices
            .iter()
            .enumerate()
            .filter_map(|(k, price)| price.map(|(extra, meeting)| (extra, k, meeting)))
            .min_by(|x, y| x.0.total_cmp(&y.0));
        let Some((extra, k, meeting)) = cheapest.filter(|cheapest| cheapest.0 <= allowance) else {
            break;
        };
        if space.is_clear(path[k - 1], meeting) && space.is_clear(meeting, path[k + 2]) {
            path[k] = meeting;
            path.remove(k + 1);
            prices.remove(k + 1);
            allowance -= extra;
            let (first, end) = (k.saturating_sub(2), (k + 3).min(path.len()));
            for (near, entry) in (first..end).zip(&mut prices[first..end]) {
                *entry = price(&path, near);
            }
        } else {
            prices[k] = None;
        }
    }
    cut_corners(&mut path, space);
    path
}

/// Drops every corner whose neighbours see each other: the path only gets shorter.
fn cut_corners(path: &mut Vec<Xy>, space: &LegSpace<'_>) {
    let mut i = 1;
    while i + 1 < path.len() {
        let straight = turn(path[i - 1], path[i], path[i + 1]).abs() < NO_TURN;
        if straight || space.is_clear(path[i - 1], path[i + 1]) {
            path.remove(i);
            i = i.saturating_sub(1).max(1);
        } else {
            i += 1;
        }
    }
}

/// Where the edge `a`-`b`, lengthened beyond `b`, meets `d`-`c`, lengthened beyond `c`: the
/// solution of `a + t (b − a) = d + s (c − d)` with `t, s > 1`.
fn meeting_point(a: Xy, b: Xy, c: Xy, d: Xy) -> Option<Xy> {
    let vector = |from: Xy, to: Xy| Vector2::new(to.x - from.x, to.y - from.y);
    let (u, v) = (vector(a, b), vector(d, c));
    if u.perp(&v).abs() < PARALLEL * u.norm() * v.norm() {
        return None;
    }
    let shares = Matrix2::from_columns(&[u, -v]).lu().solve(&vector(a, d))?;
    (shares.x > 1.0 && shares.y > 1.0).then(|| a + (b - a) * shares.x)
}

/// A finished path: what the vehicle will fly.
#[derive(Debug, Clone, PartialEq)]
pub struct Finished {
    /// The waypoints between start and goal.
    pub waypoints: Vec<LatLonE7>,
    /// The same with start and goal, as local points of the rounded positions.
    pub points: Vec<Xy>,
}

/// Why a path cannot be finished.
#[derive(Debug, thiserror::Error)]
pub enum FinishError {
    /// An edge that is really flown comes too near to a region.
    #[error("an edge of the finished path is not clear")]
    NotClear(RegionId),
    /// A point is off the map.
    #[error(transparent)]
    Projection(#[from] ProjectionError),
}

/// Rounds a path to the integers that a vehicle stores, divides edges that are too long to be
/// flown straight where something is near, and judges every edge.
///
/// # Errors
/// [`FinishError::NotClear`] with the region that is in the way.
pub fn finished(
    path: &[Xy],
    ends: (LatLon, LatLon),
    frame: &LocalFrame,
    space: &LegSpace<'_>,
) -> Result<Finished, FinishError> {
    let mut points = vec![frame.to_local(ends.0)?];
    let mut waypoints = Vec::new();
    for edge in path.windows(2) {
        // A long edge is divided only where its deviation would matter.
        let pieces = space.pieces(edge[0], edge[1]);
        for piece in 1..=pieces {
            let share = f64::from(piece) / f64::from(pieces);
            let position = frame.to_position(edge[0] + (edge[1] - edge[0]) * share)?.to_e7();
            waypoints.push(position);
        }
    }
    waypoints.pop(); // the goal
    for waypoint in &waypoints {
        let position = waypoint.to_degrees().map_err(|_| ProjectionError::Inverse {
            easting: f64::from(waypoint.lon),
            northing: f64::from(waypoint.lat),
            zone: frame.zone(),
        })?;
        points.push(frame.to_local(position)?);
    }
    points.push(frame.to_local(ends.1)?);
    for edge in points.windows(2) {
        if let Some(region) = space.flown_blocker(edge[0], edge[1]) {
            return Err(FinishError::NotClear(region));
        }
    }
    Ok(Finished { waypoints, points })
}
