//! The paper's own figures: the table "Path distance comparison across six scenarios (S1–S6)" of
//! its section "Distance Analysis", metres.
//!
//! The paper does not publish its maps. The scenarios `s1` to `s6` were made to resemble them, so
//! that its figures stand beside ours for orientation, not as measurements of the same scenes.

/// The lengths of one scenario's paths as the paper reports them, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperLengths {
    /// The scenario, in lower case: `s1` to `s6`.
    pub scenario: &'static str,
    /// A*.
    pub a_star: f64,
    /// RRT.
    pub rrt: f64,
    /// QUAV.
    pub quav: f64,
}

/// The table.
pub const PAPER_LENGTHS: [PaperLengths; 6] = [
    row("s1", 855.00, 1128.65, 876.86),
    row("s2", 625.00, 825.12, 627.97),
    row("s3", 380.00, 1561.99, 1104.11),
    row("s4", 495.00, 703.52, 548.73),
    row("s5", 380.00, 662.88, 447.08),
    row("s6", 655.00, 1130.38, 976.88),
];

const fn row(scenario: &'static str, a_star: f64, rrt: f64, quav: f64) -> PaperLengths {
    PaperLengths { scenario, a_star, rrt, quav }
}

/// The paper's figures for a scenario of this name, in either case.
#[must_use]
pub fn paper_lengths(scenario: &str) -> Option<&'static PaperLengths> {
    PAPER_LENGTHS.iter().find(|row| row.scenario.eq_ignore_ascii_case(scenario))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenarios_are_known_by_their_names_in_either_case_and_others_are_not() {
        assert_eq!(paper_lengths("S5").unwrap().quav, 447.08);
        assert_eq!(paper_lengths("s7"), None);
    }

    #[test]
    fn as_the_paper_says_a_star_is_always_the_shortest_and_rrt_the_longest() {
        for row in PAPER_LENGTHS {
            assert!(row.a_star < row.quav && row.quav < row.rrt, "{row:?}");
        }
    }
}
