//! Whatever the scene, a leg is solved where a path exists, next to the shortest one and clear of
//! everything, and refused with the reason where there is none.
//!
//! Everything that judges here is the tests' own: [`ground`] maps, [`oracle`] knows the shortest
//! path, [`judge`] measures the result from the integers that are flown. A bigger campaign:
//! `QUAVD_SCENES=50 cargo nextest run --release --run-ignored only campaign --no-capture`.

mod generate;
mod ground;
mod judge;
mod oracle;
mod plane;
mod scene;

use std::time::{Duration, Instant};

use quav::airspace::Airspace;
use quav::geodesy::{LatLonE7, LocalFrame, Zone};
use quav::planner::leg::LegRequest;
use quav::planner::leg_space::LegSpace;
use quav::planner::{LegOutcome, LegPlan, LegPlanner, PlanError, Settings};
use quav::stop::Stop;

use generate::BUFFER;
use scene::{Known, Scene};

/// What a passage may be wider or narrower than needed on each side while nothing is promised
/// about it, metres: positions are rounded to whole units, and a proof leaves a little room.
const DOUBT: f64 = 0.05;

/// The longest that a path may be over the exact shortest, and the mean of all.
const WORST: f64 = 1.02;
const MEAN: f64 = 1.005;

/// Positions are whole units of 10⁻⁷ degrees, metres: a shorter way through a passage that leaves no more
/// than this on each side is not promised.
const UNIT: f64 = 0.0111;

/// What came of a scene.
struct Report {
    name: String,
    /// Length over the exact shortest; `None` where there is no path and none was found.
    ratio: Option<f64>,
    waypoints: usize,
    rounds: usize,
    hits: usize,
    time: Duration,
}

/// Plans a scene. The places of the path with its ends, and the plan where one was needed.
fn plan(
    scene: &Scene,
    settings: Settings,
) -> Result<(Vec<LatLonE7>, Option<Box<LegPlan>>), PlanError> {
    let (from, to) = scene.ends();
    let (a, b) = (from.to_degrees().unwrap(), to.to_degrees().unwrap());
    let frame = LocalFrame::new(Zone::of_leg(a, b), a).unwrap();
    let airspace = Airspace::new(&scene.fences(), &frame, scene.rule).unwrap();
    let spread = frame.scale_spread([&a, &b]).unwrap();
    let latitude = if a.lat().abs() > b.lat().abs() { a.lat() } else { b.lat() };
    let space = LegSpace::new(&airspace, settings.buffer.0 * spread, latitude);
    let request = LegRequest { from: a, to: b, from_reach: 0.0, to_reach: 0.0 };
    let outcome =
        LegPlanner::new(settings).plan(&request, &frame, &space, &Stop::new(), 1, |_| ())?;
    Ok(match outcome {
        LegOutcome::Clear => (vec![from, to], None),
        LegOutcome::Replanned(plan) => {
            let inner = plan.finished.waypoints.iter().copied();
            (std::iter::once(from).chain(inner).chain([to]).collect(), Some(plan))
        }
    })
}

fn length(path: &[LatLonE7]) -> f64 {
    let at = |place: LatLonE7| place.to_degrees().unwrap();
    path.windows(2).map(|e| ground::ground_distance(at(e[0]), at(e[1]))).sum()
}

/// Plans a scene and holds the outcome against the oracle.
fn judged(scene: &Scene, settings: Settings) -> Result<Report, String> {
    let name = scene.name.clone();
    let began = Instant::now();
    let outcome = plan(scene, settings);
    let time = began.elapsed();
    let mut report =
        Report { name: name.clone(), ratio: None, waypoints: 0, rounds: 0, hits: 0, time };
    match outcome {
        Ok((path, plan)) => {
            if scene.known == Known::Infeasible {
                let kept = judge::clearance(scene, &path);
                let apart = plane::dist(scene.start, scene.goal);
                return Err(format!(
                    "{name}: a path through the impossible, {kept} m clear, ends {apart} m apart"
                ));
            }
            let kept = judge::clearance(scene, &path);
            if kept < BUFFER - 0.01 {
                return Err(format!("{name}: comes as near as {kept} m"));
            }
            let found = length(&path);
            // Each end may have been rounded towards the other.
            let bound = found * 1.0002 + 2.0 * UNIT;
            let exact = oracle::shortest(scene, BUFFER, Some(bound))
                .ok_or_else(|| format!("{name}: the oracle has no path of {found} m"))?;
            report.ratio = Some(found / exact);
            if found / exact > WORST
                && let Some(roomy) = oracle::shortest(scene, BUFFER + UNIT, Some(bound))
            {
                println!("  {name}: {found} m; {exact} m only with less than a unit to spare");
                report.ratio = Some(found / roomy);
            }
            report.waypoints = path.len() - 2;
            if let Some(plan) = plan {
                report.rounds = plan.rounds.len();
                report.hits = plan.rounds.iter().filter(|round| round.gap < 1e-6).count();
                if plan.rounds.is_empty() {
                    return Err(format!("{name}: no QAOA round was run"));
                }
            }
        }
        Err(PlanError::Infeasible { regions, .. }) => {
            if regions.is_empty() {
                return Err(format!("{name}: infeasible, but by nothing"));
            }
            // The oracle looks at all there is where there is no path: only where it has to.
            let is_solvable = match scene.known {
                Known::Infeasible => false,
                Known::Solvable => true,
                Known::Nothing => oracle::shortest(scene, BUFFER, None).is_some(),
            };
            if is_solvable {
                return Err(format!("{name}: a path exists, but was 'proven' not to"));
            }
        }
        Err(PlanError::EndNotClear { .. }) => {
            if scene.known == Known::Solvable || oracle::shortest(scene, BUFFER, None).is_some() {
                return Err(format!("{name}: a path exists, but an end was refused"));
            }
        }
        // Hardly wide enough, or hardly too narrow: neither a way nor a proof is promised.
        Err(PlanError::NotFound { .. })
            if oracle::shortest(scene, BUFFER + DOUBT, None).is_none()
                && oracle::shortest(scene, BUFFER - DOUBT, None).is_some() => {}
        Err(error) => {
            let exact = oracle::shortest(scene, BUFFER, None);
            return Err(format!("{name}: {error}: {error:?}; the oracle says {exact:?}"));
        }
    }
    Ok(report)
}

/// Judges all scenes; the mean and the worst of the ratios are held to the promise.
fn hold(scenes: impl IntoIterator<Item = Scene>) {
    let mut ratios = Vec::new();
    let mut wrong = Vec::new();
    for scene in scenes {
        match judged(&scene, Settings::default()) {
            Ok(report) => ratios.extend(report.ratio.map(|ratio| (ratio, report.name))),
            Err(what) => wrong.push(what),
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    let Some(worst) = ratios.iter().max_by(|a, b| a.0.total_cmp(&b.0)) else { return };
    let mean = ratios.iter().map(|ratio| ratio.0).sum::<f64>() / ratios.len() as f64;
    assert!(worst.0 <= WORST && mean <= MEAN, "mean {mean:.5}, worst {worst:?}");
    // Shorter than the shortest is impossible: the oracle or the judge would be wrong.
    assert!(ratios.iter().all(|ratio| ratio.0 > 0.9993), "{ratios:?}");
}

/// A kind of scenes: its name, and how one is made from a seed.
type Family = (&'static str, fn(u64) -> Scene);

macro_rules! families {
    ($($test:ident, $what:expr, $seeds:expr;)*) => {
        $(
            #[test]
            fn $test() {
                let make: fn(u64) -> Scene = $what;
                hold($seeds.map(make));
            }
        )*

        fn all_families() -> Vec<Family> {
            vec![$((stringify!($test), $what as fn(u64) -> Scene)),*]
        }
    };
}

families! {
    small_urban_scenes_are_solved, |s| generate::urban(10 + 7 * (s % 13) as usize, s), 0..8;
    urban_scenes_of_a_hundred_obstacles_are_solved, |s| generate::urban(100, s), 0..8;
    urban_scenes_of_a_thousand_obstacles_are_solved, |s| generate::urban(1000, s), 0..2;
    corridors_barely_wider_than_two_buffers_are_flown, generate::corridor, 0..10;
    mazes_are_solved, generate::maze, 0..8;
    spirals_are_solved, generate::spiral, 0..6;
    u_traps_are_solved, generate::u_trap, (0..8).chain([7_700_117]);
    slaloms_are_solved, generate::slalom, 0..8;
    several_inclusions_are_kept, generate::inclusions, 0..10;
    poles_are_avoided, generate::poles, (0..8).chain([4_200_004, 4_200_020, 4_200_022]);
    outlines_of_many_vertices_are_rounded, generate::many_vertices, 0..6;
    heaps_of_overlapping_shapes_are_passed, generate::heaps, 0..10;
    combs_are_threaded, generate::combs, 0..6;
    gates_barely_wide_enough_are_found, generate::gate, 0..6;
    doubtful_gates_are_passed_or_proven_shut, generate::doubtful_gate, 0..12;
    one_of_several_inclusions_is_enough, generate::unions, 0..12;
    crowded_lots_are_crossed_or_proven_shut, generate::crowded_lot, 0..12;
    sealed_yards_are_refused, generate::sealed_yard, 0..4;
    legs_of_twenty_kilometres_are_planned, generate::long_leg, 0..4;
    walls_of_kilometres_are_kept_off_on_every_line, generate::long_walls, (0..8).chain([19, 39, 42, 68]);
    the_countryside_is_crossed, generate::countryside, 0..3;
    large_mazes_are_solved, generate::large_maze, 0..1;
    the_infeasible_is_refused, generate::infeasible, 0..24;
}

#[test]
#[ignore = "a campaign of minutes; QUAVD_SCENES says how many seeds of each family"]
fn campaign() {
    let read = |name: &str| std::env::var(name).ok();
    let seeds: u64 = read("QUAVD_SCENES").and_then(|n| n.parse().ok()).unwrap_or(20);
    let first: u64 = read("QUAVD_FIRST").and_then(|n| n.parse().ok()).unwrap_or(1000);
    let only = read("QUAVD_FAMILY").unwrap_or_default();
    let settings = || match read("QUAVD_PAPER") {
        Some(_) => Settings::paper(),
        None => Settings::default(),
    };
    let mut wrong = Vec::new();
    for (family, make) in all_families().into_iter().filter(|(name, _)| name.contains(&only)) {
        let mut ratios: Vec<f64> = Vec::new();
        let (mut refused, mut rounds, mut hits, mut waypoints) = (0, 0, 0, 0);
        let (mut slowest, mut total) = (Duration::ZERO, Duration::ZERO);
        for seed in first..first + seeds {
            let scene = make(seed);
            match judged(&scene, settings()) {
                Ok(report) => {
                    if report.ratio.is_some_and(|ratio| !(0.9993..=1.01).contains(&ratio)) {
                        println!("  {} {:.5}", report.name, report.ratio.unwrap_or(0.0));
                    }
                    match report.ratio {
                        Some(ratio) => ratios.push(ratio),
                        None => refused += 1,
                    }
                    rounds += report.rounds;
                    hits += report.hits;
                    waypoints += report.waypoints;
                    slowest = slowest.max(report.time);
                    total += report.time;
                }
                Err(what) => {
                    println!("  {what}");
                    wrong.push(what);
                }
            }
        }
        let mean = ratios.iter().sum::<f64>() / ratios.len().max(1) as f64;
        let worst = ratios.iter().copied().fold(0.0, f64::max);
        if worst > WORST || mean > MEAN {
            wrong.push(format!("{family}: mean {mean:.5} worst {worst:.5}"));
        }
        println!(
            "{family}: solved {} refused {refused} mean {mean:.5} worst {worst:.5} waypoints \
             {waypoints} rounds {rounds} optimum hit {:.3} time {:?} slowest {slowest:?}",
            ratios.len(),
            f64::from(hits as u32) / f64::from((rounds as u32).max(1)),
            total / seeds as u32,
        );
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
