//! Every waiting time of the vehicle side in one place. The defaults are those of the MAVLink
//! mission protocol ("Timeouts and Retries"), scaled where a slow link needs it.

use std::hash::{BuildHasher, RandomState};
use std::time::Duration;

use tokio::time::Instant;

/// How long to wait for what.
#[derive(Debug, Clone, PartialEq)]
pub struct Timing {
    /// For the answer to a request that starts a transfer.
    pub request: Duration,
    /// For an item, at the least.
    pub item_min: Duration,
    /// For an item, at the most: what a measured round trip may stretch the wait to.
    pub item_max: Duration,
    /// How many measured round trips to wait for an item.
    pub round_trips: u32,
    /// For the answers to a round of questions for parameters.
    pub parameter: Duration,
    /// For the answer to a question of MAVLink FTP, at the least: a checksum wants a plan scanned.
    pub ftp: Duration,
    /// How often a message is repeated before it can count as unanswered.
    pub retries: u32,
    /// A transfer that has not come forward for this long is given up, after the retries. Longer
    /// than any autopilot keeps a transfer open (ArduPilot 8 s, PX4 5 s).
    pub patience: Duration,
    /// How often a transfer that was given up is begun again while the vehicle is still there.
    pub restarts: u32,
    /// How long another ground station's transfer is waited out.
    pub busy: Duration,
    /// The shortest pause before asking a busy vehicle again; at most twice this.
    pub busy_pause: Duration,
    /// For the words that explain a refusal: they may come after it.
    pub explanation: Duration,
    /// How far back words may lie that explain a refusal.
    pub explanation_age: Duration,
    /// After a fence was accepted: ArduPilot can still erase it.
    pub fence_settles: Duration,
    /// After a failed upload, before looking what it left: longer than a frame of it can still be
    /// under way on a slow network.
    pub stragglers: Duration,
    /// A vehicle that has said nothing at all for this long is not there (heartbeats come at 1 Hz).
    pub silence: Duration,
}

impl Default for Timing {
    fn default() -> Self {
        Self {
            request: Duration::from_millis(1500),
            item_min: Duration::from_millis(250),
            item_max: Duration::from_millis(1500),
            round_trips: 4,
            parameter: Duration::from_millis(400),
            ftp: Duration::from_millis(500),
            retries: 5,
            patience: Duration::from_secs(10),
            restarts: 3,
            busy: Duration::from_secs(8),
            busy_pause: Duration::from_secs(1),
            explanation: Duration::from_millis(500),
            explanation_age: Duration::from_secs(1),
            fence_settles: Duration::from_millis(1200),
            stragglers: Duration::from_secs(3),
            silence: Duration::from_secs(5),
        }
    }
}

impl Timing {
    /// For a vehicle whose clock runs `factor` times as fast, as a simulator's can: its heartbeats
    /// come that much faster, and it gives up that much earlier.
    #[must_use]
    pub fn faster(self, factor: f64) -> Self {
        let scaled = |duration: Duration| duration.div_f64(factor);
        Self {
            request: scaled(self.request),
            item_min: scaled(self.item_min),
            item_max: scaled(self.item_max),
            round_trips: self.round_trips,
            parameter: scaled(self.parameter),
            ftp: scaled(self.ftp),
            retries: self.retries,
            patience: scaled(self.patience),
            restarts: self.restarts,
            busy: scaled(self.busy),
            busy_pause: scaled(self.busy_pause),
            explanation: scaled(self.explanation),
            explanation_age: scaled(self.explanation_age),
            fence_settles: scaled(self.fence_settles),
            stragglers: scaled(self.stragglers),
            silence: scaled(self.silence),
        }
    }

    /// A pause before asking a busy vehicle again, not the same for two clients that collided.
    pub(super) fn busy_pause(&self) -> Duration {
        let fraction = f64::from(random_u16()) / f64::from(u16::MAX);
        self.busy_pause.mul_f64(1.0 + fraction)
    }
}

/// Not the same for two clients.
pub(super) fn random_u16() -> u16 {
    // A hasher's random keys are random enough to keep two clients apart.
    (RandomState::new().hash_one(0_u8) >> 48) as u16
}

/// The wait for an item, from the round trips seen so far.
#[derive(Debug)]
pub(super) struct RoundTrip {
    smoothed: Option<Duration>,
}

impl RoundTrip {
    pub(super) const fn new() -> Self {
        Self { smoothed: None }
    }

    /// Takes in one round trip of a message that was sent once only.
    pub(super) fn measured(&mut self, trip: Duration) {
        self.smoothed = Some(match self.smoothed {
            None => trip,
            // TCP's smoothing (RFC 6298, section 2).
            Some(before) => (before * 7 + trip) / 8,
        });
    }

    pub(super) fn item_wait(&self, timing: &Timing) -> Duration {
        let trip = self.smoothed.unwrap_or(Duration::ZERO);
        (trip * timing.round_trips).clamp(timing.item_min, timing.item_max)
    }
}

/// Decides when to stop asking: after the retries, and not before the patience is over.
#[derive(Debug)]
pub(super) struct Patience {
    tries: u32,
    since: Instant,
}

impl Patience {
    pub(super) fn new() -> Self {
        Self { tries: 0, since: Instant::now() }
    }

    /// Something came forward: start again.
    pub(super) fn renew(&mut self) {
        *self = Self::new();
    }

    /// Counts one more try without success. `true` when it is time to give up: after the retries
    /// and the patience, or at once when the vehicle has been `silent` for as long as that.
    pub(super) fn is_exhausted(&mut self, timing: &Timing, silent: Duration) -> bool {
        self.tries += 1;
        silent >= timing.patience
            || (self.tries > timing.retries && self.since.elapsed() >= timing.patience)
    }

    pub(super) fn waited(&self) -> Duration {
        self.since.elapsed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wait_for_an_item_follows_the_line_within_its_limits() {
        let timing = Timing::default();
        let mut trips = RoundTrip::new();
        assert_eq!(trips.item_wait(&timing), timing.item_min);
        trips.measured(Duration::from_millis(200));
        assert_eq!(trips.item_wait(&timing), Duration::from_millis(800));
        for _ in 0..50 {
            trips.measured(Duration::from_secs(3));
        }
        assert_eq!(trips.item_wait(&timing), timing.item_max);
    }

    #[tokio::test(start_paused = true)]
    async fn giving_up_takes_the_retries_and_the_patience() {
        let timing = Timing::default();
        let mut patience = Patience::new();
        let heard = Duration::ZERO;
        for _ in 0..20 {
            assert!(!patience.is_exhausted(&timing, heard), "no time has passed");
        }
        tokio::time::advance(timing.patience).await;
        assert!(patience.is_exhausted(&timing, heard));
        patience.renew();
        tokio::time::advance(timing.patience).await;
        assert!(!patience.is_exhausted(&timing, heard), "tried once only");
        assert!(patience.is_exhausted(&timing, timing.patience), "nobody is there");
    }
}
