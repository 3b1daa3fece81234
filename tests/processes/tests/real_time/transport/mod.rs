//! What the tests over loopback share. Ports are chosen by the system; patience is far longer than any test takes.

mod hub;
mod modbus;
mod reconnect;
mod run;
mod udp;

use std::future::Future;
use std::net::SocketAddr;

use can::Frame;
use processes::PATIENCE;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use transport::{AsyncBus, Hub, HubOptions, Received, SlcanBus, SocketcandBus, WallClock};

/// The output of `future`, or a failed test.
async fn soon<T>(clock: &WallClock, future: impl Future<Output = T>) -> T {
    tokio::select! {
        output = future => output,
        () = clock.sleep(PATIENCE) => panic!("still waiting after {PATIENCE:?}"),
    }
}

fn frame(text: &str) -> Frame {
    text.parse().unwrap()
}

/// A hub with one socketcand and one slcan listener.
async fn hub(clock: &WallClock) -> Hub {
    let places = ["socketcand://127.0.0.1:0", "slcan://127.0.0.1:0"].map(|place| place.parse().unwrap());
    Hub::bind(&places, HubOptions::default(), clock).await.unwrap()
}

fn socketcand_port(hub: &Hub) -> SocketAddr {
    hub.listeners()[0].address
}

fn slcan_port(hub: &Hub) -> SocketAddr {
    hub.listeners()[1].address
}

async fn socketcand(address: SocketAddr, clock: &WallClock) -> SocketcandBus {
    SocketcandBus::connect(&address.to_string(), "can0", clock).await.unwrap()
}

async fn slcan(address: SocketAddr, clock: &WallClock) -> SlcanBus {
    SlcanBus::connect(&address.to_string(), None, clock).await.unwrap()
}

/// The next frame that `bus` hears.
async fn heard(bus: &mut impl AsyncBus, clock: &WallClock) -> Frame {
    soon(clock, async {
        loop {
            if let (_, Received::Frame(frame)) = bus.recv().await.unwrap() {
                return frame;
            }
        }
    })
    .await
}

/// A connection of bytes, for what a well-behaved client does not do.
struct Raw {
    stream: TcpStream,
    clock: WallClock,
}

impl Raw {
    async fn connect(address: SocketAddr, clock: &WallClock) -> Self {
        Self { stream: TcpStream::connect(address).await.unwrap(), clock: clock.clone() }
    }

    async fn say(&mut self, bytes: &[u8]) {
        soon(&self.clock, self.stream.write_all(bytes)).await.unwrap();
    }

    /// One read, as python-can does: whatever has come, at most 256 bytes. Empty at the end of the connection.
    async fn read_once(&mut self) -> String {
        let mut buffer = [0; 256];
        let length = soon(&self.clock, self.stream.read(&mut buffer)).await.unwrap_or(0);
        String::from_utf8_lossy(&buffer[..length]).into_owned()
    }

    /// Reads until `text` has come; all that came.
    async fn read_until(&mut self, text: &str) -> String {
        let mut all = String::new();
        while !all.contains(text) {
            let more = self.read_once().await;
            assert!(!more.is_empty(), "connection closed after {all:?}");
            all.push_str(&more);
        }
        all
    }

    /// Through the greeting into raw mode, with reads that must each give exactly one message.
    async fn enter_raw_mode(&mut self) {
        assert_eq!(self.read_once().await, "< hi >");
        for request in ["< open can0 >", "< rawmode >"] {
            self.say(request.as_bytes()).await;
            assert_eq!(self.read_once().await, "< ok >");
        }
    }
}
