//! What the operating system is asked for: the machine's name, processors, memory and its limits.

use crate::record::Machine;

/// The machine that this runs on. What cannot be found out stays empty.
pub fn machine() -> Machine {
    let cpu = read("/proc/cpuinfo")
        .lines()
        .find_map(|l| Some(l.strip_prefix("model name")?.split_once(':')?.1.trim().to_owned()));
    let os = read("/etc/os-release")
        .lines()
        .find_map(|l| Some(l.strip_prefix("PRETTY_NAME=")?.trim_matches('"').to_owned()));
    Machine {
        cpu: cpu.unwrap_or_else(|| std::env::consts::ARCH.into()),
        cores: cores().len(),
        memory: memory(),
        os: os.unwrap_or_else(|| std::env::consts::OS.into()),
    }
}

fn read(path: &str) -> String {
    std::fs::read_to_string(path).unwrap_or_default()
}

/// Bytes of memory; 0 where that is not known.
pub fn memory() -> u64 {
    let kib = read("/proc/meminfo")
        .lines()
        .find_map(|l| l.strip_prefix("MemTotal:")?.split_whitespace().next()?.parse::<u64>().ok());
    1024 * kib.unwrap_or(0)
}

/// The physical cores that this process may use, each by its logical processors.
pub fn cores() -> Vec<Vec<usize>> {
    let allowed = allowed();
    let mut cores: Vec<Vec<usize>> = vec![];
    for &cpu in &allowed {
        let topology = format!("/sys/devices/system/cpu/cpu{cpu}/topology/thread_siblings_list");
        let siblings = list(read(&topology).trim());
        match cores.iter_mut().find(|core| siblings.contains(&core[0])) {
            Some(core) => core.push(cpu),
            None => cores.push(vec![cpu]),
        }
    }
    cores
}

/// A list of processors as Linux writes it, such as `0-2,5`.
fn list(text: &str) -> Vec<usize> {
    let range = |part: &str| {
        let (from, to) = part.split_once('-').unwrap_or((part, part));
        Some(from.parse().ok()?..=to.parse().ok()?)
    };
    text.split(',').filter_map(range).flatten().collect()
}

/// The logical processors that this process may use.
#[cfg(target_os = "linux")]
fn allowed() -> Vec<usize> {
    use nix::sched::{CpuSet, sched_getaffinity};
    use nix::unistd::Pid;
    let set = sched_getaffinity(Pid::from_raw(0)).ok();
    let has = |set: &CpuSet, cpu| set.is_set(cpu).unwrap_or(false);
    match set {
        Some(set) => (0..CpuSet::count()).filter(|&cpu| has(&set, cpu)).collect(),
        None => any(),
    }
}

#[cfg(not(target_os = "linux"))]
fn allowed() -> Vec<usize> {
    any()
}

fn any() -> Vec<usize> {
    (0..std::thread::available_parallelism().map_or(1, usize::from)).collect()
}

/// Keeps this process on the given processors, where the system can.
pub fn stay_on(processors: &[usize]) {
    #[cfg(target_os = "linux")]
    if !processors.is_empty() {
        use nix::sched::{CpuSet, sched_setaffinity};
        let mut set = CpuSet::new();
        // A processor that has gone since costs the pinning, not the run.
        if processors.iter().all(|&cpu| set.set(cpu).is_ok()) {
            let _ = sched_setaffinity(nix::unistd::Pid::from_raw(0), &set);
        }
    }
    #[cfg(not(target_os = "linux"))]
    let _ = processors;
}

/// Limits the address space of this process, where the system can.
pub fn limit_memory(bytes: u64) {
    #[cfg(target_os = "linux")]
    {
        use nix::sys::resource::{Resource, setrlimit};
        let _ = setrlimit(Resource::RLIMIT_AS, bytes, bytes);
    }
    #[cfg(not(target_os = "linux"))]
    let _ = bytes;
}

/// The most memory that this process ever held, bytes.
pub fn peak_memory() -> Option<u64> {
    #[cfg(unix)]
    {
        use nix::sys::resource::{UsageWho, getrusage};
        let usage = getrusage(UsageWho::RUSAGE_SELF).ok()?;
        let unit = if cfg!(target_os = "macos") { 1 } else { 1024 };
        u64::try_from(usage.max_rss()).ok().map(|rss| unit * rss)
    }
    #[cfg(not(unix))]
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn processors_are_listed_as_linux_writes_them() {
        assert_eq!(list("0-2,5"), [0, 1, 2, 5]);
        assert_eq!(list(""), [0; 0]);
    }

    #[test]
    fn the_machine_has_a_core_and_this_process_holds_memory() {
        assert!(machine().cores >= 1 && !machine().cpu.is_empty());
        if cfg!(unix) {
            assert!(peak_memory().unwrap() > 100_000);
        }
    }
}
