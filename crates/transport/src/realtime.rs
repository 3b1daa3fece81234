//! Real time for the thread that runs a bus (Linux): SCHED_FIFO (sched(7)) and memory that stays (mlockall(2)).
//!
//! What runs so is the thread of the bus ([`crate::BusThread`]) and that of its clock ([`crate::WallClock::start_in_real_time`]), which
//! waits for absolute times by a timer of the kernel. A thread that one of these starts inherits its scheduling.

/// Above everything that is not real time, and below the kernel's interrupt threads (50).
const PRIORITY: u8 = 40;

/// Why this thread does not run in real time.
#[derive(Debug, thiserror::Error)]
pub enum RealTimeError {
    /// The system does not allow SCHED_FIFO.
    #[error("this user may not run in real time (SCHED_FIFO): {reason}")]
    Scheduling {
        /// What the system said.
        reason: String,
    },
    /// The system does not allow memory to be locked.
    #[error("this user may not lock the memory of a program (mlockall): {reason}")]
    Memory {
        /// What the system said.
        reason: String,
    },
    /// There is no such thing here.
    #[error("real time is for Linux only")]
    NotHere,
}

impl RealTimeError {
    /// What to do about it.
    pub const fn advice(&self) -> &'static str {
        match self {
            Self::Scheduling { .. } | Self::Memory { .. } => {
                "allow it once: sudo setcap cap_sys_nice,cap_ipc_lock+ep $(command -v ferrodrive); or raise the limits that \
                 `ulimit -r` and `ulimit -l` show, by two lines in /etc/security/limits.conf, and log in again: \
                 `YOU - rtprio 95` and `YOU - memlock unlimited`"
            }
            Self::NotHere => "leave --realtime away",
        }
    }
}

/// From here on this thread and those that it starts run in real time, and no page of the process is ever swapped out.
#[cfg(target_os = "linux")]
pub fn enter() -> Result<(), RealTimeError> {
    use rustix::mm::{MlockAllFlags, mlockall};
    use thread_priority::{
        RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
        set_thread_priority_and_policy, thread_native_id,
    };
    let scheduling = |reason: String| RealTimeError::Scheduling { reason };
    let priority = ThreadPriorityValue::try_from(PRIORITY).map_err(|error| scheduling(format!("{error:?}")))?;
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(priority), policy).map_err(
        |error| match error {
            thread_priority::Error::OS(code) => scheduling(std::io::Error::from_raw_os_error(code).to_string()),
            other => scheduling(other.to_string()),
        },
    )?;
    mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE)
        .map_err(|error| RealTimeError::Memory { reason: error.to_string() })
}

/// See above.
#[cfg(not(target_os = "linux"))]
pub fn enter() -> Result<(), RealTimeError> {
    Err(RealTimeError::NotHere)
}

#[cfg(all(test, target_os = "linux"))]
#[allow(clippy::print_stderr, reason = "a test that is skipped says why")]
mod tests {
    use super::*;
    use crate::WallClock;

    /// Policy and priority of the threads of this process: fields 41 and 40 of /proc/PID/stat (proc_pid_stat(5)).
    fn scheduling() -> Vec<(u32, u32)> {
        let tasks = std::fs::read_dir("/proc/self/task").unwrap();
        let stats = tasks.filter_map(|task| std::fs::read_to_string(task.ok()?.path().join("stat")).ok());
        let of_stat = |stat: String| {
            let fields: Vec<u32> = stat
                .rsplit(')')
                .next()
                .into_iter()
                .flat_map(str::split_whitespace)
                .map(|field| field.parse().unwrap_or(0))
                .collect();
            (fields[38], fields[37])
        };
        stats.map(of_stat).collect()
    }

    /// In a thread of its own, which takes its scheduling with it.
    #[test]
    fn a_thread_and_its_clock_run_in_real_time_where_that_is_allowed() {
        let entered = std::thread::spawn(|| {
            if let Err(error) = enter() {
                let said = format!("{error}; {}", error.advice());
                assert!(said.contains("may not") && said.contains("limits.conf"), "{said}");
                return eprintln!("skipped: {error}");
            }
            let _clock = WallClock::start_in_real_time().unwrap();
            let fifo = scheduling().into_iter().filter(|task| *task == (1, u32::from(PRIORITY))).count();
            assert!(fifo >= 2, "{:?}", scheduling());
            let status = std::fs::read_to_string("/proc/self/status").unwrap();
            let locked = status.lines().find_map(|line| line.strip_prefix("VmLck:")).unwrap().trim();
            assert_ne!(locked, "0 kB");
        });
        entered.join().unwrap();
    }
}
