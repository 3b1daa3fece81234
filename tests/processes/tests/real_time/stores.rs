//! Stores that were confirmed to a client are on the disk, however the simulator ends.
//!
//! `FERRODRIVE_KILLS=200 cargo test --test stores` kills more often than a test run does.
#![cfg(unix)]

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use processes::raw_bus::RawBus;
use processes::{Simulator, done, scratch};

/// Communication offline time of the ZLAC8030L, 0 to 32767, which is stored with each write while 2010h is 0, as delivered.
const STORED: u16 = 0x2000;

/// Weak magnetic angle of a joint, 0 to 306.
const SAVED: u16 = 0x2604;

/// An SDO answer to a download that was taken (CiA 301, 7.2.4.3.4).
const TAKEN: &str = "60";

/// Register of the weak magnetic angle, and of 2614h, which asks for a save (manual of the joint, Modbus addresses).
const SAVED_REGISTER: u8 = 0x06;
/// Register of 2600h, which forbids writes to all others while it is 0, as delivered.
const ENABLE_REGISTER: u8 = 0x00;
const SAVE_REGISTER: u8 = 0x16;

fn simulator(state: &Path) -> Simulator {
    Simulator::start_heard(&[
        "--drive",
        "zlac8030l@4",
        "--drive",
        "m4230e17b50@1",
        "--serve",
        "socketcand://127.0.0.1:0",
        "--modbus",
        "127.0.0.1:0",
        "--state",
        state.to_str().unwrap(),
    ])
}

/// The value that a fresh start finds.
fn found(state: &Path) -> u32 {
    let simulator = simulator(state);
    let bus = simulator.bus("socketcand");
    done(&["--bus", &bus, "--json", "read", "4", "2000"]).json()["value"].as_u64().unwrap() as u32
}

#[test]
fn a_store_is_there_after_every_end_that_came_with_its_acknowledgement() {
    let state = scratch("ends");
    let ends = ["-HUP", "-INT", "-TERM", "-QUIT", "-KILL", "quit"];
    let ends = ends.iter().filter(|end| processes::is_heard(end));
    for (round, end) in ends.enumerate() {
        let value = 500 + round as u32;
        let mut simulator = simulator(&state);
        let mut bus = RawBus::connect(&simulator.address("socketcand"));
        let took = stopwatch();
        assert!(bus.download(4, STORED, 0, value, 2).is_some_and(|answer| answer.starts_with(TAKEN)));
        let took = took();
        if *end == "quit" {
            assert_eq!(simulator.ask("quit")["ok"], true);
        } else {
            simulator.signal(end);
        }
        let status = match *end {
            "-HUP" => Some(129),
            "-INT" => Some(130),
            "-QUIT" => Some(131),
            "-TERM" => Some(143),
            "-KILL" => None,
            _ => Some(0),
        };
        assert_eq!(simulator.wait(), status, "{end}");
        let found = found(&state);
        assert!(found == value || !was_promised(&simulator, took), "{found} instead of {value} after {end}");
    }
    // In a folder of its own it is as delivered (ZLAC8030L quick start guide V1.00, chapter 9).
    assert_eq!(found(&scratch("ends-elsewhere")), 1000);
}

/// How long an acknowledgement waits for the disk.
const DISK_PATIENCE: Duration = Duration::from_millis(250);

/// How long it is since then.
fn stopwatch() -> impl Fn() -> Duration {
    // The disk's time is the clock's.
    let began = Instant::now();
    move || began.elapsed()
}

/// A disk that takes longer than clients wait is not waited for, which is reported: then an ended one has promised nothing. The report
/// may be on its way when a kill comes: what took so long to be acknowledged was not promised either.
fn was_promised(simulator: &Simulator, took: Duration) -> bool {
    took < DISK_PATIENCE && !simulator.errors_left().iter().any(|line| line.contains("the disk of --state is slow"))
}

#[test]
fn a_kill_in_a_stream_of_stores_loses_none_that_was_acknowledged() {
    let kills = std::env::var("FERRODRIVE_KILLS").map_or(10, |text| text.parse().expect("a number of kills"));
    let state = scratch("stream");
    let mut value = 1;
    let mut stores = 0;
    for round in 0..kills {
        let mut simulator = simulator(&state);
        let mut bus = RawBus::connect(&simulator.address("socketcand"));
        let killer = simulator.id().to_string();
        // 0 to 120 ms later, spread evenly over the rounds (golden ratio).
        let delay = Duration::from_micros(round * 74_164 % 120_000);
        let killing = std::thread::spawn(move || {
            // The moment of the kill is what is varied.
            std::thread::sleep(delay);
            assert!(Command::new("kill").args(["-KILL", &killer]).status().unwrap().success());
        });
        let (mut acknowledged, mut took) = (None, stopwatch());
        while bus.download(4, STORED, 0, value, 2).is_some_and(|answer| answer.starts_with(TAKEN)) {
            acknowledged = Some((value, took()));
            took = stopwatch();
            stores += 1;
            // 1 to 30000 are taken.
            value = value % 30_000 + 1;
        }
        killing.join().unwrap();
        simulator.wait();
        if let Some((acknowledged, _)) = acknowledged.filter(|(_, took)| was_promised(&simulator, *took)) {
            let found = found(&state);
            // The one that was under way may be there or not.
            assert!(found == acknowledged || found == value, "kill {round}: {found} after {acknowledged}");
        }
        value = value % 30_000 + 1;
    }
    let _ = writeln!(std::io::stderr(), "{kills} kills, {stores} acknowledged stores, none lost");
    assert!(stores > 0);
}

/// One Modbus request of the joint, of function, address and a count or value; the answer after its function code.
fn register(stream: &mut TcpStream, function: u8, address: u8, value: u8) -> Vec<u8> {
    stream.write_all(&[0, 1, 0, 0, 0, 6, 1, function, 0, address, 0, value]).unwrap();
    let mut head = [0; 8];
    stream.read_exact(&mut head).unwrap();
    assert_eq!(head[7], function, "an exception: {head:?}");
    let mut rest = vec![0; usize::from(head[5]) - 2];
    stream.read_exact(&mut rest).unwrap();
    rest
}

/// By CAN and by Modbus alike.
#[test]
fn what_a_joint_says_to_have_saved_survives_a_kill() {
    let state = scratch("joint");
    for value in [40_u8, 41, 42, 43] {
        let by_modbus = value % 2 == 1;
        let mut simulator = simulator(&state);
        let took = if by_modbus {
            let mut line = TcpStream::connect(simulator.address("modbus")).unwrap();
            register(&mut line, 6, ENABLE_REGISTER, 1);
            register(&mut line, 6, SAVED_REGISTER, value);
            let took = stopwatch();
            register(&mut line, 6, SAVE_REGISTER, 1);
            while register(&mut line, 3, SAVE_REGISTER, 1) != [2, 0, 2] {}
            took()
        } else {
            let mut bus = RawBus::connect(&simulator.address("socketcand"));
            assert!(bus.download(1, SAVED, 0, value.into(), 2).is_some_and(|answer| answer.starts_with(TAKEN)));
            let took = stopwatch();
            assert!(bus.download(1, 0x2614, 0, 1, 2).is_some_and(|answer| answer.starts_with(TAKEN)));
            // 2614h reads 1 while it saves and 2 afterwards.
            while !bus.upload(1, 0x2614, 0).is_some_and(|answer| answer.starts_with("4B14260002")) {}
            took()
        };
        simulator.kill();
        let again = self::simulator(&state);
        let by_can = RawBus::connect(&again.address("socketcand")).upload(1, SAVED, 0).unwrap();
        let over_modbus = register(&mut TcpStream::connect(again.address("modbus")).unwrap(), 3, SAVED_REGISTER, 1);
        let is_there = by_can.starts_with(&format!("4B042600{value:02X}")) && over_modbus == [2, 0, value];
        assert!(is_there || !was_promised(&simulator, took), "{by_can}, {over_modbus:?} after {value}");
    }
}
