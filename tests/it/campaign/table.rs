//! The table of a campaign: what happened under which kind of fault.

use std::collections::BTreeMap;
use std::fmt;

use super::{Ended, Held};

#[derive(Default)]
struct Row {
    runs: u64,
    new: u64,
    old: u64,
    theirs: u64,
    settled_later: u64,
    at_once: u64,
    seconds: f64,
}

impl Row {
    fn add(&mut self, ended: &Ended) {
        self.runs += 1;
        match ended.held {
            Held::New => self.new += 1,
            Held::Old => self.old += 1,
            Held::Theirs => self.theirs += 1,
        }
        self.settled_later += u64::from(ended.settled_later);
        self.at_once += u64::from(ended.at_once);
        self.seconds += ended.seconds;
    }
}

/// Runs by kind of fault; a run with several counts in each of their rows.
#[derive(Default)]
pub(super) struct Table {
    all: Row,
    kinds: BTreeMap<&'static str, Row>,
}

impl Table {
    pub(super) fn add(&mut self, ended: &Ended) {
        self.all.add(ended);
        for kind in &ended.kinds {
            self.kinds.entry(kind).or_default().add(ended);
        }
    }

    /// Runs in which the new plan was verified in the first life.
    pub(super) fn at_once(&self) -> u64 {
        self.all.at_once
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let head = ["kind", "runs", "new", "old", "theirs", "at once", "later start", "mean s"];
        let [kind, runs, new, old, theirs, at_once, later, mean] = head;
        writeln!(
            f,
            "  {kind:<16}{runs:>7}{new:>7}{old:>7}{theirs:>8}{at_once:>9}{later:>13}{mean:>8}"
        )?;
        let rows = self.kinds.iter().map(|(kind, row)| (*kind, row));
        for (kind, row) in rows.chain([("all", &self.all)]) {
            let Row { runs, new, old, theirs, settled_later, at_once, seconds } = row;
            let mean = seconds / (*runs).max(1) as f64;
            writeln!(
                f,
                "  {kind:<16}{runs:>7}{new:>7}{old:>7}{theirs:>8}{at_once:>9}{settled_later:>13}{mean:>8.1}"
            )?;
        }
        Ok(())
    }
}
