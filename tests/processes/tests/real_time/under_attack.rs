//! What readers that do not read, clients that send too much and files of others can do to a simulator: nothing.
#![cfg(unix)]

use std::io::Write;
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use processes::raw_bus::RawBus;
use processes::{Simulator, done, scratch};
use serde_json::Value;

const DRIVE: [&str; 2] = ["--drive", "zlac8030l@4"];
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
fn answers_that_nobody_reads_stop_no_drive_and_their_number_is_reported() {
    const ASKED: u64 = 30_000;
    let mut simulator = Simulator::start_deaf(&SERVED);
    let mut input = simulator.take_input();
    for _ in 0..ASKED {
        writeln!(input, "4 get").unwrap();
    }
    simulator.error("standard output is not being read");
    let bus = simulator.bus("socketcand");
    assert_eq!(done(&["--bus", &bus, "--json", "read", "4", "200B"]).json()["value"], 1024);
    let (mut answered, mut dropped, mut last) = (0, 0, 0.0);
    while answered + dropped < ASKED {
        let answer: Value = serde_json::from_str(&simulator.line()).unwrap();
        match answer["dropped"].as_u64() {
            Some(count) => dropped += count,
            None => {
                let t = answer["t"].as_f64().unwrap();
                assert!(t >= last, "{t} after {last}");
                (answered, last) = (answered + 1, t);
            }
        }
    }
    assert!(dropped > 0 && answered > 5_000, "{answered} answered, {dropped} dropped");
    simulator.error("answers were dropped");
    writeln!(input, "now").unwrap();
    assert!(simulator.line().contains("behind_ms"));
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

#[test]
fn idle_connections_make_room() {
    let simulator = Simulator::start_heard(&SERVED);
    let address = simulator.address("socketcand");
    let mut honest = RawBus::connect(&address);
    let idle: Vec<TcpStream> = (0..300).map(|_| TcpStream::connect(&address).unwrap()).collect();
    let mut late = RawBus::connect(&address);
    for bus in [&mut honest, &mut late] {
        assert!(bus.upload(4, 0x200B, 0).is_some());
    }
    simulator.error("idle make room");
    drop(idle);
}

#[test]
fn an_endless_line_is_refused_without_being_kept() {
    let mut simulator = Simulator::start(&SERVED);
    let mut input = simulator.take_input();
    let chunk = [b'x'; 1 << 16];
    for _ in 0..(200 << 20) / chunk.len() {
        input.write_all(&chunk).unwrap();
    }
    writeln!(input, "\nnow").unwrap();
    assert!(simulator.line().contains("longer than 4096 bytes"));
    assert!(simulator.line().contains("behind_ms"));
    let status = std::fs::read_to_string(format!("/proc/{}/status", simulator.id())).unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.parse().ok());
    assert!(peak.is_none_or(|kilobytes: u64| kilobytes < 64 << 10), "{peak:?} kB");
}

#[test]
fn a_simulator_that_nobody_can_reach_says_so_and_runs() {
    let mut simulator = Simulator::start_heard(&DRIVE);
    assert_eq!(simulator.ready, "ready");
    assert!(simulator.error("no program can reach").contains("--serve"));
    assert_eq!(simulator.ask("now")["ok"], true);
}

#[test]
fn a_drive_that_its_image_puts_elsewhere_is_said_at_the_start() {
    let directory = scratch("elsewhere");
    let state = ["--state", directory.to_str().unwrap()];
    let mut first = Simulator::start(&[&SERVED[..], &state].concat());
    let bus = first.bus("socketcand");
    let write = |object: &str, value: &str| {
        done(&["--bus", &bus, "--model", "4=zlac8030l", "write", "4", object, value]);
    };
    // Node-ID 9, and number 2 of the bit rates, which is 250 kbit/s.
    write("200D", "9");
    write("200E", "2");
    first.ask("quit");
    first.wait();
    let second = Simulator::start_heard(&[&SERVED[..], &state].concat());
    assert!(second.error("is off the bus").contains("zlac8030l@4"));
    assert!(second.error("is node 9 on the bus").contains("zlac8030l@4"));
}
