//! Long edges of fence polygons. Two positions far apart are joined by a geodesic to one program
//! and by a straight line of latitude and longitude to another, metres apart in the middle of ten
//! kilometres. Where it matters, an edge gets vertices on that of both lines that leaves less room.

use geo::{Geodesic, InterpolatePoint, Point};

use super::outline::{MAX_VERTICES, signed_area};
use crate::geodesy::{EARTH_RADIUS, LatLon, LocalFrame, ProjectionError, Xy, wrapped};

/// Lines that are no further apart than this are the same, metres.
const SAME_LINE: f64 = 0.002;

/// Nearer to a pole nobody flies straight lines of latitude and longitude, degrees.
const POLAR: f64 = 85.0;

/// The most pieces that an edge is divided into.
const MOST_PIECES: f64 = 1000.0;

/// The vertices of a polygon in the plane, its long edges divided such that what is `forbidden`
/// inside of it (else outside) is forbidden on either line. Where a ring crosses itself it has no
/// inside to decide by, and some edges get the other line.
///
/// # Errors
/// [`ProjectionError`] where a position is too far away for the frame.
pub(super) fn projected(
    vertices: &[LatLon],
    forbidden: bool,
    frame: &LocalFrame,
) -> Result<Vec<Xy>, ProjectionError> {
    let corners: Vec<Xy> =
        vertices.iter().map(|&vertex| frame.to_local(vertex)).collect::<Result<_, _>>()?;
    let left_is_inside = signed_area(&corners) >= 0.0;
    // The points to take are those on the other side of the edge than what is allowed.
    let to_the_left = left_is_inside != forbidden;
    let mut points = Vec::with_capacity(corners.len());
    for (k, (&from, &a)) in vertices.iter().zip(&corners).enumerate() {
        points.push(a);
        if points.len() > MAX_VERTICES {
            // Too many to be taken at all.
            break;
        }
        let next = (k + 1) % corners.len();
        let (to, b) = (vertices[next], corners[next]);
        let pieces = pieces(from, to, (b.x - a.x).hypot(b.y - a.y));
        for piece in 1..pieces {
            let share = f64::from(piece) / f64::from(pieces);
            let candidates = [straight_in_degrees(from, to, share), on_geodesic(from, to, share)];
            let [one, other] = candidates.map(|place| place.map(|place| frame.to_local(place)));
            let (Some(one), Some(other)) = (one.transpose()?, other.transpose()?) else { continue };
            let side = |p: Xy| (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
            points.push(if (side(one) > side(other)) == to_the_left { one } else { other });
        }
    }
    Ok(points)
}

/// Into how many pieces an edge is divided so that both lines are the same between its vertices:
/// over a length L they are L² tan φ / 8R apart.
fn pieces(from: LatLon, to: LatLon, length: f64) -> u32 {
    let latitude = from.lat().abs().max(to.lat().abs());
    if latitude > POLAR {
        return 1;
    }
    let apart = length * length * latitude.to_radians().tan() / (8.0 * EARTH_RADIUS);
    (apart / SAME_LINE).sqrt().ceil().clamp(1.0, MOST_PIECES) as u32
}

fn straight_in_degrees(from: LatLon, to: LatLon, share: f64) -> Option<LatLon> {
    let east = wrapped(to.lon() - from.lon());
    let lon = wrapped(from.lon() + east * share);
    LatLon::new(from.lat() + (to.lat() - from.lat()) * share, lon).ok()
}

fn on_geodesic(from: LatLon, to: LatLon, share: f64) -> Option<LatLon> {
    let point = |place: LatLon| Point::new(place.lon(), place.lat());
    let at = Geodesic.point_at_ratio_between(point(from), point(to), share);
    LatLon::new(at.y(), at.x()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geodesy::Zone;

    /// A square around a place, ten kilometres wide, with or against the clock.
    fn square(lat: f64, clockwise: bool) -> (Vec<LatLon>, LocalFrame) {
        let (half_lat, half_lon) = (0.045, 0.045 / lat.to_radians().cos());
        let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
        let mut ring: Vec<LatLon> = corners
            .map(|(y, x)| LatLon::new(lat + y * half_lat, 8.0 + x * half_lon).unwrap())
            .to_vec();
        if clockwise {
            ring.reverse();
        }
        let centre = LatLon::new(lat, 8.0).unwrap();
        (ring, LocalFrame::new(Zone::of_leg(centre, centre), centre).unwrap())
    }

    #[test]
    fn an_obstacle_is_never_smaller_and_a_zone_never_larger_than_on_either_line() {
        for (lat, clockwise) in [(47.0, false), (47.0, true), (-47.0, false), (70.0, true)] {
            let (ring, frame) = square(lat, clockwise);
            let solid = projected(&ring, true, &frame).unwrap();
            let zone = projected(&ring, false, &frame).unwrap();
            let contains = crate::airspace::outline::contains;
            // The middle of each side, on both lines, a centimetre further in or out.
            for k in 0..4 {
                let (from, to) = (ring[k], ring[(k + 1) % 4]);
                for line in [straight_in_degrees, on_geodesic] {
                    let at = frame.to_local(line(from, to, 0.5).unwrap()).unwrap();
                    let out = at / at.x.hypot(at.y) * 0.01;
                    assert!(contains(&solid, at - out), "{lat} {k}");
                    assert!(!contains(&zone, at + out), "{lat} {k}");
                }
            }
            // L² tan φ / 8R on the two sides along a parallel, about ten kilometres each.
            let grown = signed_area(&solid).abs() - signed_area(&zone).abs();
            let bulge = 1e8 * lat.abs().to_radians().tan() / (8.0 * EARTH_RADIUS);
            let expected = 2.0 * 2.0 / 3.0 * bulge * 1e4;
            assert!((grown / expected - 1.0).abs() < 0.1, "{lat}: {grown} {expected}");
        }
    }

    #[test]
    fn short_edges_and_those_at_a_pole_stay_as_they_are() {
        let place = |lat: f64, lon: f64| LatLon::new(lat, lon).unwrap();
        let triangle = [place(47.0, 8.0), place(47.002, 8.0), place(47.0, 8.002)];
        let frame = LocalFrame::new(Zone::of_leg(triangle[0], triangle[1]), triangle[0]).unwrap();
        assert_eq!(projected(&triangle, true, &frame).unwrap().len(), 3);
        assert_eq!(pieces(place(88.0, 8.0), place(88.0, 80.0), 2e5), 1);
        assert_eq!(pieces(place(0.0, 8.0), place(0.0, 9.0), 1e5), 1);
    }
}
