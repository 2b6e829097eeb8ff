//! What the daemon takes of the machine, for whoever watches over it for months: all of these stay
//! where they are once every kind of work has been done, or something leaks.

use std::fs;

use serde::{Deserialize, Serialize};

/// What this process holds, as the kernel (proc(5)) and the runtime count it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Resources {
    /// Memory that is in RAM (`VmRSS`), KiB.
    pub rss_kib: u64,
    /// Threads.
    pub threads: u64,
    /// Open files, sockets and ports.
    pub descriptors: u64,
    /// Tasks of the runtime that have not ended.
    pub tasks: u64,
}

impl Resources {
    /// As of now; what the system does not tell is 0.
    #[must_use]
    pub fn now() -> Self {
        let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
        let runtime = tokio::runtime::Handle::try_current();
        Self {
            rss_kib: number(&status, "VmRSS:"),
            threads: number(&status, "Threads:"),
            // Not the one with which they are counted.
            descriptors: fs::read_dir("/proc/self/fd")
                .map_or(0, |entries| entries.count().saturating_sub(1) as u64),
            tasks: runtime.map_or(0, |runtime| runtime.metrics().num_alive_tasks() as u64),
        }
    }
}

/// The first number behind a name in `/proc/self/status`.
fn number(status: &str, name: &str) -> u64 {
    let rest = status.lines().find_map(|line| line.strip_prefix(name));
    rest.and_then(|rest| rest.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn what_is_opened_and_started_is_counted() {
        let before = Resources::now();
        assert!(before.rss_kib > 1024 && before.threads >= 1 && before.descriptors >= 3);
        let _files = [fs::File::open("/dev/null").unwrap(), fs::File::open("/dev/null").unwrap()];
        let task = tokio::spawn(std::future::pending::<()>());
        let after = Resources::now();
        assert!(after.tasks > before.tasks, "{before:?} {after:?}");
        // Other tests of this process open files as well.
        assert!(after.descriptors >= 5, "{after:?}");
        task.abort();
    }

    #[test]
    fn a_number_is_found_by_its_whole_name() {
        let status = "Name:\tquavd\nVmHWM:\t  900 kB\nVmRSS:\t  12345 kB\nThreads:\t4\n";
        assert_eq!((number(status, "VmRSS:"), number(status, "Threads:")), (12_345, 4));
        assert_eq!(number(status, "Pss:"), 0);
    }
}
