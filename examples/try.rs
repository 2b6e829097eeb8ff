use quav::airspace::*;
use quav::geodesy::*;
use quav::planner::leg::*;
use quav::planner::leg_space::*;
use quav::planner::*;
fn main() {
    let exact = [804.47, 583.33, 351.66, 465.75, 354.07, 632.90];
    let paper = std::env::args().any(|a| a == "--paper");
    let both = std::env::args().any(|a| a == "--both");
    let grid = std::env::args().any(|a| a == "--grid");
    for s in 1..=6 {
        let t0 = std::time::Instant::now();
        let name = format!("/work/shared/scenarios/s{s}.plan");
        let sc = quav::formats::read_scenario(&name, &std::fs::read(&name).unwrap()).unwrap();
        let (a, b) =
            (sc.mission.items[0].position().unwrap(), sc.mission.items[1].position().unwrap());
        let frame = LocalFrame::new(Zone::of_leg(a, b), a).unwrap();
        let air = Airspace::new(&sc.fences, &frame, InclusionRule::All).unwrap();
        let load = t0.elapsed();
        let mut st = if paper { Settings::paper() } else { Settings::default() };
        if both {
            st.source = CandidateSource::Both
        }
        if grid {
            st.source = CandidateSource::Grid
        }
        let space = LegSpace::new(&air, 5.0 * frame.scale_spread([&a, &b]).unwrap(), a.lat());
        let c = std::sync::atomic::AtomicBool::new(false);
        let mut p = LegPlanner::new(st);
        match p.plan(
            &LegRequest { from: a, to: b, from_reach: 0., to_reach: 0. },
            &frame,
            &space,
            &c,
            |r| {
                if std::env::args().any(|a| a == "-v") {
                    println!(
                        "{:?} q{} steps{} distinct{} best{:.3} opt{:.3} p{:.4} M{:.1} len {:.3} {}",
                        r.challenger,
                        r.qubits,
                        r.loss.len(),
                        r.distinct,
                        r.best_sample,
                        r.exact_optimum,
                        r.p_optimum,
                        r.penalty,
                        r.length,
                        r.improved
                    )
                }
            },
        ) {
            Ok(LegOutcome::Replanned(l)) => {
                let mut pts = vec![a];
                pts.extend(l.finished.waypoints.iter().map(|w| w.to_degrees().unwrap()));
                pts.push(b);
                let len: f64 = pts.windows(2).map(|w| geodesic_distance(w[0], w[1]).0).sum();
                let cl = l
                    .finished
                    .points
                    .windows(2)
                    .map(|w| air.clearance(w[0], w[1]))
                    .fold(f64::MAX, f64::min);
                let hit = l.rounds.iter().filter(|r| r.gap < 1e-6).count();
                println!(
                    "S{s} len {len:.2} ratio {:.5} wp {} clear {cl:.3} rounds {} opt-hit {hit} load {load:?} {:?} cands {:?}",
                    len / exact[s - 1],
                    l.finished.waypoints.len(),
                    l.rounds.len(),
                    l.times,
                    l.candidates.iter().map(|c| (c.length * 10.).round() / 10.).collect::<Vec<_>>()
                );
            }
            other => println!("S{s} {other:?}"),
        }
    }
}
