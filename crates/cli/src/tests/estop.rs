//! `estop` and `stop all` on a bus with drives that another program moves.

use cia402::object::{CONTROLWORD, MODES_OF_OPERATION, TARGET_VELOCITY};
use clap::Parser;
use processes::{Scratch, scratch};
use serde_json::{Value, json};

use std::time::Duration;

use crate::context::Context;
use crate::global::Global;
use crate::session;
use canopen::NodeId;
use console::command::estop::{Estop, StopReport, stop_all};
use master::drive::Drive;
use plot::Paint;

#[derive(Parser)]
struct GlobalArguments {
    #[command(flatten)]
    global: Global,
}

/// A bus with these drives, and the models of all that should be there.
fn line(folder: &Scratch, there: &str, named: &[&str]) -> GlobalArguments {
    let path = folder.join("bus.toml");
    std::fs::write(&path, there).expect("written");
    let bus = format!("sim:{}", path.display());
    let models = named.iter().flat_map(|model| ["--model", model]);
    GlobalArguments::parse_from(["ferrodrive", "--bus", &bus].into_iter().chain(models))
}

const SERVO: &str = "[[drive]]\nmodel = 'cia402'\nnode = 5\n";
const STEPPER: &str = "[[drive]]\nmodel = 'zlim42c'\nnode = 2\n";

fn node(raw: u8) -> NodeId {
    NodeId::new(raw).expect("a node-ID")
}

/// Sets a drive in motion as another program does: the master has no part in it.
async fn turn(context: &Context, id: NodeId) -> Drive {
    let (node, drive) = (context.network.node(id), context.drive(id).await.expect("it is known"));
    node.write(MODES_OF_OPERATION, 3_i8).await.expect("profile velocity");
    // The servo counts encoder increments, the stepper r/min.
    let counts = if id.raw() == 5 { 131_072 } else { 60 };
    node.write(TARGET_VELOCITY, counts).await.expect("60 r/min");
    for controlword in [0x06_u16, 0x07, 0x0F] {
        node.write(CONTROLWORD, controlword).await.expect("it follows");
        context.network.sleep(Duration::from_millis(100)).await;
    }
    context.network.sleep(Duration::from_secs(2)).await;
    assert!(speed_rpm(&drive).await > 50.0, "node {id} turns at {} r/min", speed_rpm(&drive).await);
    drive
}

async fn speed_rpm(drive: &Drive) -> f64 {
    drive.state().await.expect("it answers").velocity.expect("it has one").0.abs()
}

fn json_of(report: &StopReport) -> Value {
    serde_json::to_value(report).expect("JSON")
}

#[test]
fn everything_stops_and_each_drive_is_said_to_stand_and_by_what() {
    let both = format!("{SERVO}{STEPPER}");
    for by_ramp in [false, true] {
        let folder = scratch("estop_all");
        let line = line(&folder, &both, &[]);
        session::run(&line.global, async |context| {
            let drives = [turn(context, node(5)).await, turn(context, node(2)).await];
            let report = if by_ramp { stop_all(context).await? } else { Estop::default().run(context).await? };
            let said = json_of(&report);
            let nodes = said["nodes"].as_array().expect("a list");
            assert_eq!(nodes.iter().map(|row| &row["node"]).collect::<Vec<_>>(), [2, 5], "{said}");
            assert!(said["ok"] == true && nodes.iter().all(|row| row["stands"] == true), "{said}");
            // 605Ah as delivered: 5 of the stepper, which stays in quick stop active; 2 of the servo, which goes without power.
            let expected = if by_ramp { ["ramp", "ramp"] } else { ["quick stop", "no power"] };
            assert_eq!(nodes.iter().map(|row| &row["way"]).collect::<Vec<_>>(), expected, "{said}");
            for drive in &drives {
                assert!(speed_rpm(drive).await < 1.0, "{said}");
            }
            Ok(())
        })
        .unwrap_or_else(|failure| panic!("{failure}"));
    }
}

#[test]
fn a_drive_that_was_not_seen_to_stand_may_still_be_moving() {
    let folder = scratch("estop_silent");
    let line = line(&folder, SERVO, &["2=zlim42c"]);
    session::run(&line.global, async |context| {
        turn(context, node(5)).await;
        let report = Estop::default().run(context).await?;
        let said = json_of(&report);
        let stands = said["nodes"].as_array().expect("a list").iter().map(|row| (&row["node"], &row["stands"]));
        assert_eq!(stands.collect::<Vec<_>>(), [(&json!(2), &json!(false)), (&json!(5), &json!(true))], "{said}");
        let failure = report.failure().expect("it failed");
        assert_eq!((&said["ok"], failure.kind), (&json!(false), "not_stopped"), "{said}");
        assert!(failure.next.iter().any(|next| next.contains("emergency stop")), "{failure}");
        let people = report.text(Paint::OFF);
        assert!(people.contains("node 2 (zlim42c): may still be moving"), "{people}");
        Ok(())
    })
    .unwrap_or_else(|failure| panic!("{failure}"));
}
