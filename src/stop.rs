//! [`Stop`]: how planning is called off from outside, and how long it may take.
//!
//! Cheap enough to be asked inside searches: a flag shared by all clones, and a deadline. Nothing
//! here waits; what runs long asks [`Stop::check`] now and then.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Whether to go on. Clones share the flag; each has its own deadline.
#[derive(Debug, Clone, Default)]
pub struct Stop {
    cancelled: Arc<AtomicBool>,
    deadline: Option<Instant>,
}

/// Why to end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Stopped {
    /// Nobody wants the result any more.
    #[error("planning was cancelled")]
    Cancelled,
    /// The time is up; the best result until now is wanted.
    #[error("the deadline has passed")]
    DeadlinePassed,
}

impl Stop {
    /// Goes on until somebody calls [`Stop::cancel`].
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The same flag with a deadline from now, if there is no earlier one.
    #[must_use]
    pub fn within(&self, time: Duration) -> Self {
        let deadline = Instant::now().checked_add(time);
        let earlier = |own: Instant| deadline.map_or(own, |deadline| own.min(deadline));
        Self { deadline: self.deadline.map(earlier).or(deadline), ..self.clone() }
    }

    /// The same flag with one part of the time that is left, of `parts` equal ones.
    #[must_use]
    pub fn share(&self, parts: usize) -> Self {
        let parts = u32::try_from(parts).unwrap_or(u32::MAX).max(1);
        self.remaining().map_or_else(|| self.clone(), |left| self.within(left / parts))
    }

    /// Tells everything that holds a clone to end.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// The time until the deadline, zero once it has passed; `None` without one.
    #[must_use]
    pub fn remaining(&self) -> Option<Duration> {
        self.deadline.map(|deadline| deadline.saturating_duration_since(Instant::now()))
    }

    /// Whether to end.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.check().is_err()
    }

    /// Whether to go on.
    ///
    /// # Errors
    /// [`Stopped`] with the reason to end; being cancelled goes before being late.
    pub fn check(&self) -> Result<(), Stopped> {
        if self.cancelled.load(Ordering::Relaxed) {
            Err(Stopped::Cancelled)
        } else if self.deadline.is_some_and(|deadline| Instant::now() >= deadline) {
            Err(Stopped::DeadlinePassed)
        } else {
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cancelling_reaches_every_clone_and_goes_before_the_deadline() {
        let stop = Stop::new();
        let (late, early) = (stop.share(3), stop.within(Duration::ZERO));
        assert_eq!(late.check(), Ok(()));
        assert_eq!(early.check(), Err(Stopped::DeadlinePassed));
        stop.cancel();
        assert_eq!(late.check(), Err(Stopped::Cancelled));
        assert_eq!(early.check(), Err(Stopped::Cancelled));
    }

    #[test]
    fn a_later_deadline_does_not_replace_an_earlier_one() {
        let stop = Stop::new().within(Duration::from_secs(100));
        let later = stop.within(Duration::from_secs(1000));
        assert!(later.remaining().unwrap() <= Duration::from_secs(100));
        assert!(stop.share(4).remaining().unwrap() <= Duration::from_secs(25));
        assert_eq!(Stop::new().share(4).remaining(), None);
        assert!(Stop::new().within(Duration::MAX).remaining().is_none());
    }
}
