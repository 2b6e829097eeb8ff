//! How much memory the machine has left, so that a problem too large for it is refused in advance.

/// What is assumed where the system does not say.
const UNKNOWN: u64 = 1 << 30;

/// Bytes that can be allocated without swapping; nine tenths of what the kernel estimates.
#[must_use]
pub fn available() -> u64 {
    let meminfo = std::fs::read_to_string("/proc/meminfo").unwrap_or_default();
    parse(&meminfo).map_or(UNKNOWN, |bytes| bytes / 10 * 9)
}

fn parse(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kib.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kernel_counts_in_kibibytes() {
        let meminfo = "MemTotal:  24000000 kB\nMemAvailable:   1000 kB\n";
        assert_eq!(parse(meminfo), Some(1_024_000));
        assert_eq!(parse("MemTotal: 1 kB"), None);
    }
}
