//! What readers that do not read and clients that send too much can do to a simulator: nothing. Who makes room is asked of the hub
//! (`transport/hub.rs`), what happens to lines that are too long or not read in `crates/serve/src/{input,messages}.rs`.
#![cfg(unix)]

use std::io::Write;
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use processes::Simulator;
use processes::raw_bus::RawBus;

const SERVED: [&str; 4] = ["--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"];

/// Connections that send the same over and over until they are dropped.
struct Flood(Arc<AtomicBool>, Vec<std::thread::JoinHandle<()>>);

impl Flood {
    fn start(address: &str, connections: usize, greeting: &'static str, bytes: &'static str) -> Self {
        let over = Arc::new(AtomicBool::new(false));
        let threads = (0..connections).map(|_| {
            let (over, mut stream) = (Arc::clone(&over), TcpStream::connect(address).unwrap());
            std::thread::spawn(move || {
                // So that it looks whether it is over.
                stream.set_write_timeout(Some(std::time::Duration::from_millis(50))).unwrap();
                let burst = bytes.repeat(4096 / bytes.len());
                let _ = stream.write_all(greeting.as_bytes());
                // The answers are not read: a flooder may be held up by that as well as by the bus.
                while !over.load(Ordering::Relaxed) {
                    let _ = stream.write(burst.as_bytes());
                }
            })
        });
        Self(Arc::clone(&over), threads.collect())
    }
}

impl Drop for Flood {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
        self.1.drain(..).for_each(|thread| thread.join().unwrap());
    }
}

#[test]
fn every_signal_ends_a_simulator_whose_answers_nobody_reads() {
    let signals = [("-TERM", 143), ("-INT", 130), ("-HUP", 129), ("-QUIT", 131)];
    for (signal, status) in signals.into_iter().filter(|(signal, _)| processes::is_heard(signal)) {
        let mut simulator = Simulator::start_deaf(&SERVED);
        let mut input = simulator.take_input();
        for _ in 0..2_000 {
            writeln!(input, "4 get").unwrap();
        }
        // The drive answers: the commands have not stopped it.
        let mut bus = RawBus::connect(&simulator.address("socketcand"));
        assert!(bus.upload(4, 0x200B, 0).is_some());
        simulator.signal(signal);
        assert_eq!(simulator.wait(), Some(status), "{signal}");
        // It ends without a word, but for those of a machine that is busy.
        let said: Vec<_> = simulator.errors_left().into_iter().filter(|line| !line.contains("the clock")).collect();
        assert!(said.is_empty(), "{signal}: {said:?}");
    }
}

#[test]
fn garbage_of_many_clients_takes_no_time_from_the_drives() {
    let mut simulator = Simulator::start(&SERVED);
    let address = simulator.address("socketcand");
    let before = simulator.ask("now")["t"].as_f64().unwrap();
    let flood = Flood::start(&address, 40, "", "<<<< send 1 x >");
    let waited_before = waited_s(simulator.id());
    // What the drives' time is compared with; what the machine had no processor for does not count.
    let start = std::time::Instant::now();
    // The comparison's length.
    while start.elapsed().as_secs() < 2 {
        simulator.ask("4 get");
    }
    // What the drives' time is compared with.
    let elapsed = start.elapsed().as_secs_f64();
    let now = simulator.ask("now");
    let waited = waited_s(simulator.id()) - waited_before;
    drop(flood);
    // Without a budget for clients it is 26 % to 93 % of the time that passes.
    let gained = now["t"].as_f64().unwrap() - before;
    assert!(gained > 0.9 * (elapsed - waited), "{gained} s of {elapsed} s, {waited} s without a processor: {now}");
}

/// How long a process was ready to run and had no processor, in s, all its threads together: the second number of
/// `/proc/PID/schedstat` (Linux, Documentation/scheduler/sched-stats.rst).
fn waited_s(process: u32) -> f64 {
    let threads = std::fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten();
    let waited = threads.filter_map(|thread| {
        let text = std::fs::read_to_string(thread.path().join("schedstat")).ok()?;
        text.split_whitespace().nth(1)?.parse::<u64>().ok()
    });
    waited.sum::<u64>() as f64 * 1e-9
}

#[test]
fn among_twenty_flooders_of_a_higher_priority_an_honest_client_is_answered_each_time() {
    let simulator = Simulator::start(&[&SERVED[..], &["--bitrate", "1M"]].concat());
    let address = simulator.address("socketcand");
    let mut honest = RawBus::connect(&address);
    let flood = Flood::start(&address, 20, "< open can0 >", "< send 300 8 1 2 3 4 5 6 7 8 >");
    honest.frame("300").unwrap();
    // That it waits for one frame of each flooder is held where turns are given (`serve::round_robin`).
    let mut others = 0;
    for _ in 0..25 {
        assert!(honest.say("< send 604 8 40 B 20 0 0 0 0 0 >"));
        others += honest.frame("584").expect("an answer").1;
    }
    drop(flood);
    assert!(others > 25, "the flooders were heard: {others} frames");
}
