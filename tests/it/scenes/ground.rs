//! The tests' own map: the plane that touches the ellipsoid at a place, seen from straight above.
//! Nothing of it is shared with quavd's projections; it holds everywhere, the poles and the
//! antimeridian included, and is true to 1e-6 within 10 km of its origin.

use quav::geodesy::LatLon;

/// A point of a tangent plane: metres east and north of its origin.
pub(crate) type P = [f64; 2];

const A: f64 = 6_378_137.0;
const F: f64 = 1.0 / 298.257_223_563;
const B: f64 = A * (1.0 - F);
const E2: f64 = F * (2.0 - F);

/// A tangent plane.
pub(crate) struct Ground {
    origin: [f64; 3],
    east: [f64; 3],
    north: [f64; 3],
    up: [f64; 3],
}

impl Ground {
    pub(crate) fn new(lat: f64, lon: f64) -> Self {
        let (sin_lat, cos_lat) = lat.to_radians().sin_cos();
        let (sin_lon, cos_lon) = lon.to_radians().sin_cos();
        Self {
            origin: ecef(lat, lon),
            east: [-sin_lon, cos_lon, 0.0],
            north: [-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat],
            up: [cos_lat * cos_lon, cos_lat * sin_lon, sin_lat],
        }
    }

    /// The plane in the middle between two positions.
    pub(crate) fn between(a: LatLon, b: LatLon) -> Self {
        let (p, q) = (ecef(a.lat(), a.lon()), ecef(b.lat(), b.lon()));
        let middle = geodetic([p[0] + q[0], p[1] + q[1], p[2] + q[2]].map(|c| c / 2.0));
        Self::new(middle.lat(), middle.lon())
    }

    pub(crate) fn xy(&self, position: LatLon) -> P {
        let here = ecef(position.lat(), position.lon());
        let off: [f64; 3] = std::array::from_fn(|k| here[k] - self.origin[k]);
        [dot(off, self.east), dot(off, self.north)]
    }

    /// The position on the ellipsoid under a point of the plane.
    pub(crate) fn position(&self, p: P) -> LatLon {
        let on_plane: [f64; 3] =
            std::array::from_fn(|k| self.origin[k] + p[0] * self.east[k] + p[1] * self.north[k]);
        // The ellipsoid is a unit sphere in coordinates divided by its axes.
        let squash = |v: [f64; 3]| [v[0] / A, v[1] / A, v[2] / B];
        let (o, u) = (squash(on_plane), squash(self.up));
        let (a, half_b, c) = (dot(u, u), dot(o, u), dot(o, o) - 1.0);
        let t = -c / (half_b + (half_b * half_b - a * c).sqrt());
        geodetic(std::array::from_fn(|k| on_plane[k] + t * self.up[k]))
    }
}

/// The distance over the ground, good to millimetres for 20 km.
pub(crate) fn ground_distance(a: LatLon, b: LatLon) -> f64 {
    let (p, q) = (ecef(a.lat(), a.lon()), ecef(b.lat(), b.lon()));
    let off: [f64; 3] = std::array::from_fn(|k| p[k] - q[k]);
    let chord = dot(off, off).sqrt();
    chord * (1.0 + chord * chord / (24.0 * A * A))
}

fn ecef(lat: f64, lon: f64) -> [f64; 3] {
    let (sin_lat, cos_lat) = lat.to_radians().sin_cos();
    let (sin_lon, cos_lon) = lon.to_radians().sin_cos();
    let n = A / (1.0 - E2 * sin_lat * sin_lat).sqrt();
    [n * cos_lat * cos_lon, n * cos_lat * sin_lon, n * (1.0 - E2) * sin_lat]
}

/// The position of a point near the ellipsoid (exact on it).
fn geodetic(v: [f64; 3]) -> LatLon {
    let lat = v[2].atan2((1.0 - E2) * v[0].hypot(v[1])).to_degrees();
    LatLon::new(lat.clamp(-90.0, 90.0), v[1].atan2(v[0]).to_degrees()).unwrap()
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[test]
fn the_map_of_the_tests_agrees_with_geodesics_everywhere() {
    use quav::geodesy::geodesic_distance;
    for (lat, lon) in [(0.0, 0.0), (51.0, 4.0), (-33.0, 180.0), (89.99, 12.0), (-90.0, 0.0)] {
        let ground = Ground::new(lat, lon);
        for p in [[300.0, 400.0], [-3000.0, 4000.0], [0.0, -10_000.0]] {
            let position = ground.position(p);
            let back = ground.xy(position);
            assert!((back[0] - p[0]).hypot(back[1] - p[1]) < 1e-6, "{back:?} {p:?}");
            let (o, length) = (ground.position([0.0, 0.0]), p[0].hypot(p[1]));
            let geodesic = geodesic_distance(o, position).0;
            assert!((geodesic / length - 1.0).abs() < 1e-6, "{lat} {p:?} {geodesic}");
            assert!((ground_distance(o, position) - geodesic).abs() < 1e-2);
        }
    }
}
