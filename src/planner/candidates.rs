//! Candidate paths for one leg (the paper's "Path Finding"): structurally different ones, which
//! pass obstacles on different sides. Full enumeration is exponential; a bounded number of
//! diverse candidates stands for it.

use geo::Line;
use serde::Serialize;

use super::corners::{COARSE, FINE};
use super::enclosure::{Enclosure, enclosure};
use super::finish::{WORTH_OF_FEW, with_few_corners};
use super::grid::GridSearch;
use super::homotopy::passes_differently;
use super::leg_space::LegSpace;
use super::polyline::{distance, length, turning};
use super::search::{CornerPath, CornerSearch};
use super::settings::Settings;
use crate::geodesy::Xy;
use crate::stop::Stop;
use crate::units::Metres;

/// How near a barrier is to a ray that meets it, metres.
const ON_THE_RAY: f64 = 1e-6;

/// So many times the wanted grid paths are looked at: eight directions tell little of which will
/// be the shortest once it is taut.
const GRID_CHOICE: usize = 4;

/// How many times a grid without a clear path is made finer.
const GRID_HALVINGS: u32 = 3;

/// A way that is longer than this many times the shortest cannot win.
const WORTH_A_TRY: f64 = 1.5;

/// Where a candidate comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// The straight line from start to goal, obstacles or not.
    Straight,
    /// The paper's grid.
    Grid,
    /// The corners of the buffered obstacles.
    Corners,
}

/// A candidate path with its intrinsic properties.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// From start to goal, local metres.
    pub points: Vec<Xy>,
    /// What found it.
    pub source: Source,
    /// Euclidean length, metres.
    pub length: f64,
    /// Cumulative turning angle, radians.
    pub turning: f64,
    /// Whether every edge keeps the planning margin.
    pub clear: bool,
    /// The resolution of the grid that it was found on, where it was.
    pub resolution: Option<Metres>,
}

impl Candidate {
    fn new(points: Vec<Xy>, source: Source, space: &LegSpace<'_>) -> Self {
        let clear = points.windows(2).all(|edge| space.is_clear(edge[0], edge[1]));
        let (length, turning) = (length(&points), turning(&points));
        Self { length, turning, points, source, clear, resolution: None }
    }
}

/// The candidates of a leg: the shortest clear one first, the straight line last.
///
/// With [`super::settings::CandidateSource::Corners`] the shortest path over obstacle corners,
/// then the best ones that are shut out of a gap of a better one; with `Grid` (the paper) paths
/// over the grid only. As in the paper, the straight line is a candidate although it may collide.
/// When stopped it is what was found until then.
///
/// # Errors
/// The proof that there is no way, where there is one.
pub fn candidates(
    space: &LegSpace<'_>,
    start: Xy,
    goal: Xy,
    settings: &Settings,
    stop: &Stop,
) -> Result<Vec<Candidate>, Enclosure> {
    let mut found: Vec<Candidate> = Vec::new();
    let wanted = settings.candidates.max(1);
    let mut asked_for_a_proof = false;
    let mut no_way = |found: &[Candidate]| {
        let clear = found.iter().any(|candidate| candidate.clear);
        if clear || stop.is_stopped() || std::mem::replace(&mut asked_for_a_proof, true) {
            return Ok(());
        }
        enclosure(space, start, goal).map_or(Ok(()), Err)
    };
    if settings.source.uses_corners() {
        let mut search = CornerSearch::new(*space, start, goal, COARSE, stop);
        for path in different_ways(&mut search, space, wanted) {
            let points = with_corners_that_fit(&path.points, space, settings.qubits);
            found.push(Candidate::new(points, Source::Corners, space));
        }
        // A proof is quicker than a grid.
        no_way(&found)?;
    }
    if settings.source.uses_grid() || found.is_empty() {
        let more = wanted.saturating_sub(found.len()).max(1);
        found.extend(grid_candidates(space, start, goal, settings, more, stop));
        no_way(&found)?;
    }
    found.sort_by(|a, b| b.clear.cmp(&a.clear).then(a.length.total_cmp(&b.length)));
    found.push(Candidate::new(vec![start, goal], Source::Straight, space));
    Ok(found)
}

/// Different paths over the grid, pulled taut where the next point but one is in sight. Where the
/// grid is too coarse to have a clear path, it is halved.
fn grid_candidates(
    space: &LegSpace<'_>,
    start: Xy,
    goal: Xy,
    settings: &Settings,
    wanted: usize,
    stop: &Stop,
) -> Vec<Candidate> {
    for halvings in 0..=GRID_HALVINGS {
        let resolution = settings.grid.0 / f64::from(1u32 << halvings);
        let grid = GridSearch::new(space, start, goal, Metres(resolution), stop);
        let mut found: Vec<Candidate> = grid
            .paths(GRID_CHOICE * wanted)
            .into_iter()
            .map(|path| {
                let path = with_corners_that_fit(&path, space, settings.qubits);
                let candidate = Candidate::new(path, Source::Grid, space);
                Candidate { resolution: Some(grid.resolution()), ..candidate }
            })
            .collect();
        found.sort_by(|a, b| b.clear.cmp(&a.clear).then(a.length.total_cmp(&b.length)));
        found.truncate(wanted);
        if found.iter().any(|candidate| candidate.clear)
            || grid.resolution().0 > resolution
            || stop.is_stopped()
        {
            return found;
        }
    }
    Vec::new()
}

/// A path with as few corners as its length allows, and where that costs little with few enough to
/// leave some qubits to the refinement, or at least for one qubit an edge.
fn with_corners_that_fit(path: &[Xy], space: &LegSpace<'_>, qubits: usize) -> Vec<Xy> {
    let few = |factor: f64| with_few_corners(path, space, factor * WORTH_OF_FEW);
    let fits = |path: &[Xy]| 4 * path.len() <= 3 * qubits + 4;
    let all = few(1.0);
    if fits(&all) {
        return all;
    }
    let fewer = few(2.0);
    if fits(&fewer) {
        return fewer;
    }
    let fewest = few(4.0);
    if fewest.len() <= qubits + 1 { fewest } else { all }
}

/// The shortest path, and then for each gap that it takes a short one with that gap shut.
fn different_ways(
    search: &mut CornerSearch<'_>,
    space: &LegSpace<'_>,
    wanted: usize,
) -> Vec<CornerPath> {
    let Some(shortest) = search.shortest() else { return Vec::new() };
    let longest = WORTH_A_TRY * shortest.length();
    let mut gaps = gaps(&shortest, space);
    // The narrowest gaps first: these are where passing on the other side is a different way.
    gaps.sort_by(|a, b| line_length(a).total_cmp(&line_length(b)));
    let mut ways = vec![rounded(search, shortest)];
    for gap in gaps {
        if ways.len() >= wanted {
            break;
        }
        if let Some(way) = search.around(&[gap], longest) {
            let way = rounded(search, way);
            if ways.iter().all(|known| passes_differently(&known.points, &way.points, space)) {
                ways.push(way);
            }
        }
    }
    ways
}

/// The same path with finely rounded corners.
fn rounded(search: &CornerSearch<'_>, path: CornerPath) -> CornerPath {
    search.finer(&path, FINE).within(path.length()).unwrap_or(path)
}

/// The gaps between obstacles through which a path passes, one for each obstacle that it goes
/// round: a line from the corner outwards to the next obstacle, or far out.
fn gaps(path: &CornerPath, space: &LegSpace<'_>) -> Vec<Line> {
    let far = length(&path.points);
    let mut gaps = Vec::new();
    let mut last_region = None;
    for corner in &path.corners {
        if last_region == Some(corner.region) {
            continue;
        }
        last_region = Some(corner.region);
        // With the boundary on the left of the tangent, outwards is to the right of it.
        let outwards = Xy { x: corner.tangent.y, y: -corner.tangent.x };
        let foot = corner.point - outwards * space.planning_margin();
        let ray = Line::new(corner.point, corner.point + outwards * far);
        let reach = space
            .airspace()
            .barriers()
            .within(ray, ON_THE_RAY)
            .filter_map(|(_, barrier)| barrier.first_hit(ray))
            .fold(far, f64::min);
        gaps.push(Line::new(foot, corner.point + outwards * reach));
    }
    gaps
}

fn line_length(line: &Line) -> f64 {
    distance(line.start, line.end)
}
