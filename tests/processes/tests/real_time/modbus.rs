//! `ferrodrive sim --modbus`: a joint in real time under a Modbus client of another make (tokio-modbus), with the
//! addresses and scales of the "M Robot Joint Motor CanOpen Manual", 5.04.

use std::time::{Duration, Instant};

use processes::{PATIENCE, Simulator, done};
use tokio_modbus::client::Context;
use tokio_modbus::prelude::*;

const JOINT: u8 = 2;
const ARGUMENTS: [&str; 8] = [
    "--drive",
    "m4230e17b50@2",
    "--drive",
    "zlac8030l@4",
    "--serve",
    "socketcand://127.0.0.1:0",
    "--modbus",
    "127.0.0.1:0",
];

const MODBUS_ENABLE: u16 = 0x00;
const PROFILE_VELOCITY: u16 = 0x02;
const CURRENT: u16 = 0x11;
const SPEED: u16 = 0x12;
const VOLTAGE: u16 = 0x13;
const POSITION: u16 = 0x18;
const TARGET_POSITION: u16 = 0x1C;
const TARGET_VELOCITY: u16 = 0x1E;
const CONTROLWORD: u16 = 0x23;
const STATUSWORD: u16 = 0x24;
const MODE: u16 = 0x25;

async fn client(simulator: &Simulator, unit: u8) -> Context {
    tcp::connect_slave(simulator.address("modbus").parse().unwrap(), Slave(unit)).await.unwrap()
}

async fn write(client: &mut Context, address: u16, words: &[u16]) {
    client.write_multiple_registers(address, words).await.unwrap().unwrap();
}

async fn read(client: &mut Context, address: u16) -> u16 {
    client.read_holding_registers(address, 1).await.unwrap().unwrap()[0]
}

async fn position(client: &mut Context) -> i32 {
    let words = client.read_holding_registers(POSITION, 2).await.unwrap().unwrap();
    (u32::from(words[1]) << 16 | u32::from(words[0])) as i32
}

/// Waits until `value` of the joint is in `range`.
async fn until(what: &str, range: std::ops::RangeInclusive<i32>, mut value: impl AsyncFnMut() -> i32) {
    // The watchdog's.
    let start = Instant::now();
    loop {
        let now = value().await;
        if range.contains(&now) {
            return;
        }
        // The watchdog's.
        assert!(start.elapsed() < PATIENCE, "{what} is {now}, not in {range:?}");
        // Looked at again and again.
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

#[tokio::test]
async fn a_joint_moves_and_tells_its_values_in_the_scales_of_the_manual() {
    let mut simulator = Simulator::start(&ARGUMENTS);
    let mut joint = client(&simulator, JOINT).await;
    write(&mut joint, MODBUS_ENABLE, &[1]).await;

    // Position mode: one turn of the motor back, at 600 r/min.
    let start = position(&mut joint).await;
    let target = (start - 32_768) as u32;
    write(&mut joint, MODE, &[1]).await;
    write(&mut joint, PROFILE_VELOCITY, &[600, 0]).await;
    write(&mut joint, CONTROLWORD, &[0x0E]).await;
    write(&mut joint, TARGET_POSITION, &[target as u16, (target >> 16) as u16]).await;
    write(&mut joint, CONTROLWORD, &[0x1E]).await;
    let there = target as i32 - 50..=target as i32 + 50;
    until("the position", there, async || position(&mut joint).await).await;
    until("bit 10 of the statusword", 1..=1, async || i32::from(read(&mut joint, STATUSWORD).await >> 10 & 1)).await;
    let get = simulator.ask("2 get");
    assert!((get["position"].as_i64().unwrap() - i64::from(target as i32)).abs() <= 50, "{get}");

    // 1/327 V.
    let supply_v = f64::from(read(&mut joint, VOLTAGE).await) / 327.0;
    assert!((supply_v - simulator.ask("2 get")["supply_v"].as_f64().unwrap()).abs() < 0.5, "{supply_v} V");

    // Speed mode: -300 r/min under load, in 0.1 r/min.
    simulator.ask("2 load torque -2");
    write(&mut joint, MODE, &[3]).await;
    write(&mut joint, TARGET_VELOCITY, &[(-300_i16) as u16, 0xFFFF]).await;
    let speed = async || i32::from(read(&mut joint, SPEED).await as i16);
    until("the speed", -3050..=-2950, speed).await;
    // 1/2000 A, without a sign.
    let mut current = async || f64::from(read(&mut joint, CURRENT).await) / 2000.0;
    let (reported_a, true_a) = (current().await, simulator.ask("2 get")["current_a"].as_f64().unwrap().abs());
    assert!((reported_a - true_a).abs() < 0.2 + 0.3 * true_a, "{reported_a} A reported, {true_a} A true");

    // CANopen has the same object. (Of a drive that it does not know the command line shows the bits.)
    let over_can = done(&["--bus", &simulator.bus("socketcand"), "--json", "read", "2", "60FF"]).json();
    assert_eq!(over_can["value"].as_i64().unwrap() as i32, -300, "{over_can}");
}

#[tokio::test]
async fn only_a_joint_with_power_answers_and_only_its_registers() {
    let mut simulator = Simulator::start(&ARGUMENTS);
    let mut joint = client(&simulator, JOINT).await;
    assert_eq!(joint.read_holding_registers(0x27, 1).await.unwrap(), Err(ExceptionCode::IllegalDataAddress));
    // "0: modbus forbid" (5.04, 2600h): only 2600h itself is written.
    assert_eq!(joint.write_single_register(MODE, 3).await.unwrap(), Err(ExceptionCode::IllegalFunction));
    write(&mut joint, MODBUS_ENABLE, &[1]).await;
    assert_eq!(joint.write_single_register(VOLTAGE, 1).await.unwrap(), Err(ExceptionCode::IllegalDataAddress));
    assert_eq!(joint.write_single_register(MODE, 2).await.unwrap(), Err(ExceptionCode::IllegalDataValue));
    // A ZLAC8030L has no RS485 here.
    for unit in [0, 1, 4] {
        let mut absent = client(&simulator, unit).await;
        let answer = absent.read_holding_registers(0, 1).await.unwrap();
        assert_eq!(answer, Err(ExceptionCode::GatewayTargetDevice), "{unit}");
    }
    assert_eq!(simulator.ask("2 power off")["ok"], true);
    // It answers for as long as the charge of its bus lasts.
    let gone = Err(ExceptionCode::GatewayTargetDevice);
    until("its silence", 1..=1, async || i32::from(joint.read_holding_registers(0, 1).await.unwrap() == gone)).await;
    assert_eq!(simulator.ask("2 power on")["ok"], true);
    until("the joint", 1..=1, async || i32::from(joint.read_holding_registers(0, 1).await.unwrap().is_ok())).await;
}

#[tokio::test]
async fn clients_share_a_joint_and_one_that_leaves_does_not_stop_it() {
    let simulator = Simulator::start(&ARGUMENTS);
    let (mut first, mut second) = (client(&simulator, JOINT).await, client(&simulator, JOINT).await);
    write(&mut first, MODBUS_ENABLE, &[1]).await;
    write(&mut first, MODE, &[3]).await;
    write(&mut first, TARGET_VELOCITY, &[100, 0]).await;
    write(&mut second, CONTROLWORD, &[0x0F]).await;
    drop(first);
    until("the speed", 950..=1050, async || i32::from(read(&mut second, SPEED).await as i16)).await;
}
