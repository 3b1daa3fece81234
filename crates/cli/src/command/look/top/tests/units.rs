//! `units` of a machine file in the studio and in `top`: the same intent is the same counts as by a command.

use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use canopen::NodeId;
use cia402::object::{PROFILE_VELOCITY, TARGET_POSITION, TARGET_VELOCITY};
use clap::Parser;
use crossterm::event::KeyCode;
use host::{DriveView, Host, LocalClient, Shown, Snapshot};
use processes::scratch;
use serde_json::{Value, json};

use super::key;
use crate::command::look::studio::setting;
use crate::command::look::top::app::{Action, App};
use crate::context::Context;
use crate::failure::Failure;
use crate::global::Global;
use crate::session;

/// The servo `cia402` (131072 counts a turn) behind a gear of 50.
const MACHINE: &str = "[[drive]]\nmodel = 'cia402'\nnode = 1\nunits = { gear_ratio = 50 }\n";

const COUNTS_PER_TURN: f64 = 131_072.0 * 50.0;

#[derive(Parser)]
struct GlobalArguments {
    #[command(flatten)]
    global: Global,
}

/// What the host shows, once that is as wanted.
async fn shown(client: &mut LocalClient, wanted: impl Fn(&DriveView) -> bool) -> Arc<Snapshot> {
    loop {
        if let Shown::State(state) = client.shown().await
            && drive(&state).is_some_and(&wanted)
        {
            return state;
        }
    }
}

/// The values of the one drive.
fn drive(state: &Snapshot) -> Option<&DriveView> {
    state.nodes.first()?.drive.as_deref()
}

async fn must(client: &mut LocalClient, message: Value) {
    let answer = client.say(message.clone()).await;
    assert_eq!(answer["ok"], true, "{message}: {answer}");
}

fn near(what: &str, counts: i32, expected: f64) {
    assert!((f64::from(counts) - expected).abs() <= 20.0, "{what}: {counts}, not {expected}");
}

/// A page of the studio says what it wants by messages; so does the terminal, by its keys.
async fn by_both_doors(context: &Context, app: &host::HostHandle) {
    let node = context.network.node(NodeId::new(1).expect("a node-ID"));
    let read = async |mux| node.read::<i32>(mux).await.expect("it answers");
    let mut client = LocalClient::take(app).await.expect("there is room");
    shown(&mut client, |_| true).await;
    must(&mut client, json!({ "do": "take_control" })).await;
    must(&mut client, json!({ "do": "accept_unguarded", "node": 1 })).await;
    must(&mut client, json!({ "do": "move", "node": 1, "degrees": 3.6, "rpm": 6 })).await;
    near("an angle", read(TARGET_POSITION).await, 3.6 / 360.0 * COUNTS_PER_TURN);
    near("its speed", read(PROFILE_VELOCITY).await, 6.0 / 60.0 * COUNTS_PER_TURN);
    let is_there = |drive: &DriveView| drive.angle_degrees.is_some_and(|at| (at - 3.6).abs() < 0.01);
    let state = shown(&mut client, is_there).await;
    must(&mut client, json!({ "do": "velocity", "node": 1, "rpm": -6 })).await;
    near("a speed", read(TARGET_VELOCITY).await, -6.0 / 60.0 * COUNTS_PER_TURN);
    must(&mut client, json!({ "do": "stop", "node": 1 })).await;

    let mut top = App::new(client.id());
    top.take(state);
    assert_eq!(
        top.node().and_then(|node| node.drive.as_ref()?.angle_degrees).map(|at| (at * 100.0).round()),
        Some(360.0)
    );
    let mut jogged = false;
    // A key that is held: its first repeat comes after half a second.
    for pause_ms in [500].into_iter().chain([33; 20]) {
        for action in top.key(key(KeyCode::Right), context.network.now()) {
            let Action::Say(message) = action else { panic!("{action:?}") };
            jogged |= message["do"] == "jog";
            must(&mut client, message).await;
        }
        context.network.sleep(Duration::from_millis(pause_ms)).await;
    }
    assert!(jogged);
    near("a jog", read(TARGET_VELOCITY).await, top.jog_rpm() / 60.0 * COUNTS_PER_TURN);
    let state = shown(&mut client, |_| true).await;
    let speed = drive(&state).and_then(|drive| drive.velocity_rpm).expect("a speed");
    assert!((speed - top.jog_rpm()).abs() < 0.5, "{speed} r/min of the output");
}

#[test]
fn the_units_of_a_machine_file_count_in_the_studio_and_in_top() {
    let folder = scratch("top_units");
    let file = folder.join("machine.toml");
    std::fs::write(&file, MACHINE).expect("written");
    let line = GlobalArguments::parse_from(["ferrodrive", "--bus", &format!("sim:{}", file.display())]);
    let ended = session::run(&line.global, async |context| {
        context.traffic.listen();
        let (host, app) = Host::new(context.network.clone(), setting(context));
        let mut host = pin!(host.run(|| context.traffic.take()));
        tokio::select! {
            () = by_both_doors(context, &app) => Ok::<(), Failure>(()),
            () = &mut host => panic!("a host runs as long as there is a app"),
        }
    });
    ended.unwrap_or_else(|failure| panic!("{failure:?}"));
}
