//! Judges a path from the integers that a vehicle holds, without quavd's geometry: every edge on
//! the plane that touches the Earth in its middle.
//!
//! Long edges of paths and fences are no straight lines to everybody: they are judged both as
//! geodesics and as straight lines of latitude and longitude, which is how autopilots see them.

use quav::geodesy::{LatLon, LatLonE7};

use super::ground::{Ground, P};
use super::plane::{edges, inside, point_to_segment, segment_to_segment};
use super::scene::{Scene, Shape};

/// Edges longer than this are divided when they are taken as straight in degrees, metres.
const PIECE: f64 = 250.0;

/// Beyond this latitude nobody flies straight lines of latitude and longitude.
const POLAR: f64 = 85.0;

/// How near a path comes to any region's edge, metres; 0 on a wrong side.
pub(crate) fn clearance(scene: &Scene, path: &[LatLonE7]) -> f64 {
    let ground = scene.ground();
    let judged = scene.regions.iter().filter(|region| !(region.inclusion && scene.is_union()));
    let regions: Vec<(bool, Vec<LatLon>, f64)> = judged
        .map(|region| match &region.shape {
            Shape::Ring(ring) => {
                let ring = ring.iter().map(|&p| ground.position(p)).collect();
                (region.inclusion, ring, 0.0)
            }
            Shape::Disc(centre, radius) => {
                (region.inclusion, vec![ground.position(*centre)], *radius)
            }
        })
        .collect();
    let kept = path
        .windows(2)
        .map(|edge| {
            let (a, b) = (edge[0].to_degrees().unwrap(), edge[1].to_degrees().unwrap());
            edge_clearance(a, b, &regions)
        })
        .fold(f64::INFINITY, f64::min);
    if scene.is_union() { kept.min(union_clearance(scene, path)) } else { kept }
}

/// The same from the edge of all inclusions together, on the scene's own map: these scenes are
/// small.
fn union_clearance(scene: &Scene, path: &[LatLonE7]) -> f64 {
    let ground = scene.ground();
    let flown: Vec<P> = path.iter().map(|place| ground.xy(place.to_degrees().unwrap())).collect();
    if !scene.zones().iter().any(|zone| inside(flown[0], zone)) {
        return 0.0;
    }
    let (walls, _) = scene.union_edge();
    let apart = |way: &[P]| {
        let nearest = walls.iter().map(|&(a, b)| segment_to_segment(way[0], way[1], a, b));
        nearest.fold(f64::INFINITY, f64::min)
    };
    flown.windows(2).map(apart).fold(f64::INFINITY, f64::min)
}

fn edge_clearance(a: LatLon, b: LatLon, regions: &[(bool, Vec<LatLon>, f64)]) -> f64 {
    let plane = Ground::between(a, b);
    let flown = variants(&plane, a, b);
    let mut nearest = f64::INFINITY;
    for (inclusion, places, radius) in regions {
        for way in &flown {
            let clearance = if let [centre] = places[..] {
                let centre = plane.xy(centre);
                if *inclusion {
                    let far = |p: &P| (p[0] - centre[0]).hypot(p[1] - centre[1]);
                    radius - way.iter().map(far).fold(0.0, f64::max)
                } else {
                    let apart = |w: &[P]| point_to_segment(centre, w[0], w[1]) - radius;
                    way.windows(2).map(apart).fold(f64::INFINITY, f64::min)
                }
            } else {
                ring_clearance(&plane, way, places, *inclusion)
            };
            nearest = nearest.min(clearance.max(0.0));
        }
    }
    nearest
}

fn ring_clearance(plane: &Ground, way: &[P], places: &[LatLon], inclusion: bool) -> f64 {
    let corners: Vec<P> = places.iter().map(|&place| plane.xy(place)).collect();
    if inside(way[0], &corners) != inclusion {
        return 0.0;
    }
    let mut nearest = f64::INFINITY;
    for (i, (c, d)) in edges(&corners).enumerate() {
        let far = (c[0] - d[0]).hypot(c[1] - d[1]) < PIECE;
        let walls = if far {
            vec![vec![c, d]]
        } else {
            variants(plane, places[i], places[(i + 1) % places.len()])
        };
        for wall in walls.iter().flat_map(|wall| wall.windows(2)) {
            for edge in way.windows(2) {
                nearest = nearest.min(segment_to_segment(edge[0], edge[1], wall[0], wall[1]));
            }
        }
    }
    nearest
}

/// An edge as a geodesic and as a straight line of latitude and longitude.
fn variants(plane: &Ground, a: LatLon, b: LatLon) -> Vec<Vec<P>> {
    let straight = vec![plane.xy(a), plane.xy(b)];
    let length = (straight[0][0] - straight[1][0]).hypot(straight[0][1] - straight[1][1]);
    if length < PIECE || a.lat().abs().max(b.lat().abs()) > POLAR {
        return vec![straight];
    }
    let east = (b.lon() - a.lon() + 540.0).rem_euclid(360.0) - 180.0;
    let pieces = (length / PIECE).ceil();
    let at = |k: u32| {
        let share = f64::from(k) / pieces;
        let lon = (a.lon() + east * share + 540.0).rem_euclid(360.0) - 180.0;
        plane.xy(LatLon::new(a.lat() + (b.lat() - a.lat()) * share, lon).unwrap())
    };
    vec![straight, (0..=pieces as u32).map(at).collect()]
}
