//! Pauses that double, so that a vehicle that is off costs nothing.

use std::time::Duration;

/// The first pause.
const SHORTEST: Duration = Duration::from_secs(1);

/// The pauses between tries.
#[derive(Debug)]
pub(super) struct Backoff {
    next: Duration,
    longest: Duration,
}

impl Backoff {
    pub(super) fn new(longest: Duration) -> Self {
        Self { next: SHORTEST.min(longest), longest }
    }

    /// The pause before the next try; each is twice the one before.
    pub(super) fn pause(&mut self) -> Duration {
        let pause = self.next;
        self.next = (pause * 2).min(self.longest);
        pause
    }

    /// It worked: the next failure is a new one.
    pub(super) fn reset(&mut self) {
        *self = Self::new(self.longest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_double_up_to_the_longest_and_begin_again() {
        let mut backoff = Backoff::new(Duration::from_secs(5));
        let seconds: Vec<u64> = (0..5).map(|_| backoff.pause().as_secs()).collect();
        assert_eq!(seconds, [1, 2, 4, 5, 5]);
        backoff.reset();
        assert_eq!(backoff.pause(), SHORTEST);
    }
}
