//! `ferrodrive sim --modbus`: a joint in real time under two Modbus clients of another make (tokio-modbus). What a joint answers is
//! asked in virtual time (`crates/serve/src/registers/tests.rs`).

use std::time::{Duration, Instant};

use processes::{PATIENCE, Simulator, done};
use tokio_modbus::client::Context;
use tokio_modbus::prelude::*;

const JOINT: u8 = 2;
const ARGUMENTS: [&str; 6] =
    ["--drive", "m4230e17b50@2", "--serve", "socketcand://127.0.0.1:0", "--modbus", "127.0.0.1:0"];

const MODBUS_ENABLE: u16 = 0x00;
const SPEED: u16 = 0x12;
const TARGET_VELOCITY: u16 = 0x1E;
const CONTROLWORD: u16 = 0x23;
const MODE: u16 = 0x25;

async fn client(simulator: &Simulator) -> Context {
    tcp::connect_slave(simulator.address("modbus").parse().unwrap(), Slave(JOINT)).await.unwrap()
}

async fn write(client: &mut Context, address: u16, words: &[u16]) {
    client.write_multiple_registers(address, words).await.unwrap().unwrap();
}

/// In 0.1 r/min.
async fn speed(client: &mut Context) -> i16 {
    client.read_holding_registers(SPEED, 1).await.unwrap().unwrap()[0] as i16
}

#[tokio::test]
async fn clients_share_a_joint_and_one_that_leaves_does_not_stop_it() {
    let simulator = Simulator::start(&ARGUMENTS);
    let (mut first, mut second) = (client(&simulator).await, client(&simulator).await);
    write(&mut first, MODBUS_ENABLE, &[1]).await;
    write(&mut first, MODE, &[3]).await;
    write(&mut first, TARGET_VELOCITY, &[100, 0]).await;
    write(&mut second, CONTROLWORD, &[0x0F]).await;
    drop(first);
    // The watchdog's.
    let start = Instant::now();
    while !(950..=1050).contains(&speed(&mut second).await) {
        // The watchdog's.
        assert!(start.elapsed() < PATIENCE, "it turns at {}", speed(&mut second).await);
        // Looked at again and again.
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    // CANopen has the same object. (Of a drive that it does not know the command line shows the bits.)
    let over_can = done(&["--bus", &simulator.bus("socketcand"), "--json", "read", "2", "60FF"]).json();
    assert_eq!(over_can["value"].as_i64().unwrap() as i32, 100, "{over_can}");
}
