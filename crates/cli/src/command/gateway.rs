//! `ferrodrive gateway`: the ASCII protocol of CiA 309-3 over TCP.

mod client;
mod guards;
mod places;
mod request;

use std::cell::Cell;
use std::net::SocketAddr;
use std::time::Duration;

use canopen::NodeId;
use master::core::{Event, NodeSet};
use master::drive::{Stopped, SwitchedOff};
use serde::Serialize;
use tokio::net::TcpListener;
use tokio::sync::{broadcast, mpsc};

use client::Handle;
use guards::Guards;
use places::{MAX_CLIENTS, Places};
use request::{Gone, Guard};

use crate::context::Context;
use crate::failure::Failure;
use crate::output::{Format, Report};
use plot::Paint;

/// Serve the bus to other programs as text over TCP (CiA 309-3)
///
/// Several clients may be connected. When the connection of a client ends, the drives that it may have set in motion
/// are quick-stopped; a drive that monitors its host is guarded before it is moved, so that it stops when the gateway
/// dies. There is no password: anyone who reaches the port can move the drives. docs/handbook/gateway.md describes the
/// commands.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 gateway --listen 127.0.0.1:7000\n  \
    printf '[1] 4 r 0x1018 1 x32\\n' | nc 127.0.0.1 7000")]
pub(crate) struct Gateway {
    /// Address to listen at; port 0 takes a free one, which the first line of output names
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:7000", value_parser = address)]
    listen: String,
}

/// An address to listen at, as far as that can be said without asking for its name.
pub(super) fn address(text: &str) -> Result<String, String> {
    match text.rsplit_once(':') {
        Some((host, port)) if !host.is_empty() && port.parse::<u16>().is_ok() => Ok(text.to_owned()),
        _ => Err("expected HOST:PORT, e.g. 127.0.0.1:0, with a port of 0 to 65535".into()),
    }
}

/// How often what the network has noticed is looked for.
const EVENT_INTERVAL: Duration = Duration::from_millis(20);

/// Pause after a failed accept (out of file descriptors): the clients that are there go on.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Requests of clients that may wait.
const REQUESTS: usize = 64;

/// Events that may wait for a client; a slower one misses the oldest.
const EVENTS: usize = 256;

/// Where the gateway listens.
#[derive(Debug, Serialize)]
struct Ready {
    listen: SocketAddr,
}

impl Report for Ready {
    fn text(&self, _: Paint) -> String {
        format!("ready gateway {}", self.listen)
    }
}

impl Gateway {
    /// Serves until a signal ends it.
    pub(crate) async fn run(&self, context: &Context, format: Format) -> Result<(), Failure> {
        if context.is_embedded() {
            return Err(Failure::usage("a gateway cannot serve a virtual bus of this command alone")
                .because("such a bus has virtual time, in which no client can connect")
                .next("ferrodrive sim --drive MODEL@NODE --serve socketcand://127.0.0.1:29536, then --bus socketcand://127.0.0.1:29536/can0"));
        }
        let cannot = |error: std::io::Error| {
            Failure::new(format!("cannot listen at {}", self.listen))
                .because(error)
                .next("give --listen HOST:PORT of this machine, with a port that is free; port 0 takes any")
        };
        let listener = TcpListener::bind(&self.listen).await.map_err(cannot)?;
        let address = listener.local_addr().map_err(cannot)?;
        if !address.ip().is_loopback() {
            context.note(&format!("there is no password: anyone who can reach {address} can move the drives"));
        }
        format.print(&Ready { listen: address }).map_err(Failure::of_stdout)?;
        let (guard, guards) = mpsc::channel(REQUESTS);
        // Unbounded in type only: each client goes once.
        let (gone, parted) = mpsc::unbounded_channel();
        let (left, unguarded) = mpsc::unbounded_channel();
        // Neither who comes nor who is to be stopped waits for a drive that does not answer.
        tokio::select! {
            () = accept_clients(context, &listener, guard, gone) => {}
            () = see_off(context, parted, left) => {}
            () = see_guarded(context, guards, unguarded) => {}
        }
        Ok(())
    }
}

/// Accepts clients, and sends all of them the events of the network.
async fn accept_clients(
    context: &Context,
    listener: &TcpListener,
    guards: mpsc::Sender<Guard>,
    gone: mpsc::UnboundedSender<Gone>,
) {
    let (events, _) = broadcast::channel::<Event>(EVENTS);
    let mut places = Places::default();
    let is_noted = Cell::new(false);
    loop {
        tokio::select! {
            accepted = listener.accept() => {
                let Ok((stream, peer)) = accepted else {
                    context.network.sleep(ACCEPT_PAUSE).await;
                    continue;
                };
                let (place, displaced) = places.take(peer, context.network.now());
                if let Some(displaced) = displaced.filter(|_| !is_noted.replace(true)) {
                    context.note(&format!(
                        "{MAX_CLIENTS} clients are connected: {displaced}, silent for the longest, has made room for {peer}; \
                         further clients get a place in the same way"
                    ));
                }
                let handle = Handle {
                    frames: context.traffic.of_others(),
                    events: events.subscribe(),
                    guards: guards.clone(),
                    gone: gone.clone(),
                };
                tokio::spawn(client::serve(stream, context.network.clone(), handle, place));
            }
            () = context.network.sleep(EVENT_INTERVAL) => {
                while let Some((_, event)) = context.network.poll_event() {
                    // There may be no client.
                    let _ = events.send(event);
                }
            }
        }
    }
}

/// Guards what is about to be moved, and gives the guards back that no client needs any more; one at a time, so that no guard is given
/// back while another client asks for it.
async fn see_guarded(context: &Context, mut asked: mpsc::Receiver<Guard>, mut left: mpsc::UnboundedReceiver<NodeSet>) {
    let mut guards = Guards::default();
    loop {
        tokio::select! {
            biased;
            // A client asks before it goes.
            Some(Guard(nodes, done)) = asked.recv() => {
                for node in guards.take(nodes).iter() {
                    match guard(context, node).await {
                        Ok(()) => guards.note(node),
                        Err(why) => context.note(&format!("node {node}: nothing stops it when this gateway dies: {why}")),
                    }
                }
                // The client may have gone.
                let _ = done.send(());
            }
            Some(nodes) = left.recv() => {
                // What has a watch and was not seen to stand is left to it.
                let _ = context.network.release_guards(guards.give(nodes)).await;
            }
            else => return,
        }
    }
}

/// Stops what a client that has gone has moved.
async fn see_off(context: &Context, mut parted: mpsc::UnboundedReceiver<Gone>, left: mpsc::UnboundedSender<NodeSet>) {
    while let Some(Gone { moved, guarded }) = parted.recv().await {
        for Stopped { node, outcome, .. } in context.network.stop_moved(moved).await {
            let text = match outcome {
                Ok(_) => format!("node {node}: its client has gone; it has been quick-stopped and stands"),
                Err(error) => format!("node {node} may still be moving, and its client has gone: {error}"),
            };
            context.note(&text);
        }
        // It ends with this.
        let _ = left.send(guarded);
    }
}

/// Makes the drive stop by itself without this program, or returns why it cannot.
async fn guard(context: &Context, node: NodeId) -> Result<(), String> {
    let drive = context.drive_to_stop(node).await.map_err(|failure| failure.what)?;
    let loss = drive.guard(SwitchedOff::Leave).await.map_err(|error| error.to_string())?;
    if loss.stops_after().is_none() { Err(loss.to_string()) } else { Ok(()) }
}
