//! `ferrodrive gateway`: the ASCII protocol of CiA 309-3 over TCP.

mod client;
mod places;

use std::cell::Cell;
use std::net::SocketAddr;
use std::time::Duration;

use canopen::NodeId;
use host::clients::Clients;
use master::core::Event;
use serde::Serialize;
use tokio::net::TcpListener;
use tokio::sync::broadcast;

use client::Handle;
use places::{MAX_CLIENTS, Places};

use crate::context::Context;
use crate::failure::Failure;
use crate::output::{Format, Report};
use crate::served::listen;
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
pub(in crate::command) fn address(text: &str) -> Result<String, String> {
    match text.rsplit_once(':') {
        Some((host, port)) if !host.is_empty() && port.parse::<u16>().is_ok() => Ok(text.to_owned()),
        _ => Err("expected HOST:PORT, e.g. 127.0.0.1:0, with a port of 0 to 65535".into()),
    }
}

/// How often what the network has noticed is looked for.
const EVENT_INTERVAL: Duration = Duration::from_millis(20);

/// Pause after a failed accept (out of file descriptors): the clients that are there go on.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

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
        let (listener, address) = listen(&self.listen).await?;
        if !address.ip().is_loopback() {
            context.note(&format!("there is no password: anyone who can reach {address} can move the drives"));
        }
        format.print(&Ready { listen: address }).map_err(Failure::of_stdout)?;
        let drive = async |node: NodeId| context.drive_to_stop(node).await.map_err(|failure| failure.what.clone());
        let (clients, serving) = Clients::of(&context.network, "this gateway", drive, |text| context.note(text));
        tokio::select! {
            () = accept_clients(context, &listener, clients) => {}
            () = serving => {}
        }
        Ok(())
    }
}

/// Accepts clients, and sends all of them the events of the network.
async fn accept_clients(context: &Context, listener: &TcpListener, clients: Clients) {
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
                    client: clients.join(),
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
