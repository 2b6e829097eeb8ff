//! What is to be done next, and when: the pause after a change, the regular look, and who waits
//! for an answer. Pure; the clock is the caller's.

use std::time::Duration;

use tokio::time::Instant;

use super::requests::Asker;

/// The wait before something that failed is tried again.
const RETRY: Duration = Duration::from_secs(5);
/// The longest wait before that.
const LONGEST_RETRY: Duration = Duration::from_secs(120);
/// Askers remembered; more than there can be ground stations.
const MOST_ASKERS: usize = 8;

/// A reason to look at the vehicle.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Due {
    /// In words.
    pub(super) trigger: &'static str,
    /// When the change was seen.
    pub(super) since: Instant,
    /// Plan also what was planned already.
    pub(super) force: bool,
    /// Who is to be told the outcome.
    pub(super) askers: Vec<Asker>,
}

/// The agenda.
#[derive(Debug)]
pub(super) struct Agenda {
    next: Option<(Instant, Due)>,
    look_at: Instant,
    failures: u32,
    quiet: Duration,
    poll: Duration,
}

impl Agenda {
    pub(super) fn new(now: Instant, quiet: Duration, poll: Duration) -> Self {
        Self { next: None, look_at: now + poll, failures: 0, quiet, poll }
    }

    /// Other times from now on.
    pub(super) fn set_times(&mut self, quiet: Duration, poll: Duration) {
        (self.quiet, self.poll) = (quiet, poll);
    }

    /// The plans may have changed: look when they have been quiet for a while.
    pub(super) fn changed(&mut self, now: Instant, trigger: &'static str) {
        self.failures = 0;
        self.put(now, now + self.quiet, trigger, false);
    }

    /// Somebody transfers: what is due waits for the end of it.
    pub(super) fn transfer(&mut self, now: Instant) {
        if let Some((at, _)) = &mut self.next {
            *at = (*at).max(now + self.quiet);
        }
    }

    /// Plan at once, whether something changed or not.
    pub(super) fn asked(&mut self, now: Instant, trigger: &'static str, asker: Option<Asker>) {
        self.put(now, now, trigger, true);
        if let (Some((at, due)), Some(asker)) = (&mut self.next, asker) {
            *at = now;
            if !due.askers.contains(&asker) && due.askers.len() < MOST_ASKERS {
                due.askers.push(asker);
            }
        }
    }

    /// What was begun has to be done again, after the pause.
    pub(super) fn again(&mut self, now: Instant, due: Due) {
        let Due { trigger, since, force, askers } = due;
        self.put(now, now + self.quiet, trigger, force);
        if let Some((_, next)) = &mut self.next {
            next.since = next.since.min(since);
            for asker in askers {
                if !next.askers.contains(&asker) && next.askers.len() < MOST_ASKERS {
                    next.askers.push(asker);
                }
            }
        }
    }

    /// It failed for a reason that may pass: try again, later each time.
    pub(super) fn failed(&mut self, now: Instant, trigger: &'static str, force: bool) {
        let wait = RETRY * 2_u32.saturating_pow(self.failures.min(8));
        self.failures += 1;
        self.put(now, now + wait.min(LONGEST_RETRY), trigger, force);
    }

    /// It was done.
    pub(super) fn done(&mut self, now: Instant) {
        self.failures = 0;
        self.look_at = now + self.poll;
    }

    fn put(&mut self, now: Instant, at: Instant, trigger: &'static str, force: bool) {
        match &mut self.next {
            // The later time: each sign of a change begins the pause anew.
            Some((due_at, due)) => {
                *due_at = at;
                due.force |= force;
            }
            None => {
                let due = Due { trigger, since: now, force, askers: Vec::new() };
                self.next = Some((at, due));
            }
        }
    }

    /// When something is due.
    pub(super) fn at(&self) -> Instant {
        self.next.as_ref().map_or(self.look_at, |(at, _)| (*at).min(self.look_at))
    }

    /// What is due now, if anything.
    pub(super) fn take(&mut self, now: Instant) -> Option<Due> {
        if let Some((_, due)) = self.next.take_if(|(at, _)| *at <= now) {
            self.look_at = now + self.poll;
            return Some(due);
        }
        if self.look_at <= now {
            self.look_at = now + self.poll;
            // While a pause runs, its own look comes soon enough.
            let regular = Due {
                trigger: "the regular look found a change",
                since: now,
                force: false,
                askers: Vec::new(),
            };
            return self.next.is_none().then_some(regular);
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::{ComponentId, Node, SystemId};

    const QUIET: Duration = Duration::from_secs(1);
    const POLL: Duration = Duration::from_secs(30);

    fn seconds(seconds: f64) -> Duration {
        Duration::from_secs_f64(seconds)
    }

    #[tokio::test(start_paused = true)]
    async fn changes_and_transfers_begin_the_pause_anew() {
        let start = Instant::now();
        let mut agenda = Agenda::new(start, QUIET, POLL);
        agenda.changed(start, "a");
        agenda.changed(start + seconds(0.8), "b");
        agenda.transfer(start + seconds(1.5));
        assert_eq!(agenda.at(), start + seconds(2.5));
        assert_eq!(agenda.take(start + seconds(2.4)), None);
        let due = agenda.take(start + seconds(2.5)).unwrap();
        assert_eq!((due.trigger, due.since, due.force), ("a", start, false));
        assert_eq!(agenda.take(start + seconds(2.6)), None, "once only");
    }

    #[tokio::test(start_paused = true)]
    async fn a_transfer_alone_is_no_reason_to_look() {
        let start = Instant::now();
        let mut agenda = Agenda::new(start, QUIET, POLL);
        agenda.transfer(start);
        assert_eq!(agenda.at(), start + POLL);
        assert_eq!(agenda.take(start + POLL).unwrap().trigger, "the regular look found a change");
        assert_eq!(agenda.at(), start + POLL * 2);
    }

    #[tokio::test(start_paused = true)]
    async fn who_asks_is_served_at_once_and_told() {
        let start = Instant::now();
        let mut agenda = Agenda::new(start, QUIET, POLL);
        let node = Node { system: SystemId(255), component: ComponentId(190) };
        let asker = Asker { node, command: 31_010 };
        agenda.changed(start, "a");
        agenda.asked(start, "asked", Some(asker));
        agenda.asked(start, "asked", Some(asker));
        let due = agenda.take(start).unwrap();
        assert_eq!((due.force, due.askers.len()), (true, 1));
        agenda.again(start, due);
        assert_eq!(agenda.take(start + QUIET).unwrap().askers, [asker]);
    }

    #[tokio::test(start_paused = true)]
    async fn failures_are_tried_again_later_each_time_until_something_changes() {
        let start = Instant::now();
        let mut agenda = Agenda::new(start, QUIET, seconds(3600.0));
        let mut waits = Vec::new();
        for _ in 0..7 {
            agenda.failed(start, "x", false);
            waits.push((agenda.at() - start).as_secs());
            agenda.take(agenda.at()).unwrap();
        }
        assert_eq!(waits, [5, 10, 20, 40, 80, 120, 120]);
        agenda.changed(start, "new");
        agenda.take(agenda.at()).unwrap();
        agenda.failed(start, "x", false);
        assert_eq!((agenda.at() - start).as_secs(), 5);
    }
}
