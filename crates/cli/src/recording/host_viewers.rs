//! What a host sees of its bus, for viewers: frames, what it reads of the drives, and news.

use std::cell::RefCell;
use std::convert::Infallible;
use std::time::Duration;

use can::{BusFrame, Instant};
use foxglove::Server;
use host::{DriveView, HostHandle, News, Snapshot};
use recording::{Batch, Column, Mark, Severity};
use tokio::sync::broadcast::error::RecvError;

/// How often what has come is handed to the viewers.
const HANDED_ON: Duration = Duration::from_millis(50);

/// Frames between two of these times at most: a bus of 1 Mbit/s carries some 1,000.
const MOST_FRAMES: usize = 8_000;

/// Signals of a drive, by the names of a record, as far as a host reads them.
const SIGNALS: [&str; 6] = ["velocity_rpm", "output_angle_rad", "current_a", "supply_v", "motor_c", "driver_c"];

/// Viewers of a host; without a server it does nothing.
pub(crate) struct HostViewers(Option<RefCell<ViewerFeed>>);

struct ViewerFeed {
    server: Server,
    /// The drives that have a channel, and when the last values of each were read, s.
    drives: Vec<(u8, f64)>,
    batch: Batch,
}

impl HostViewers {
    pub(crate) fn new(server: Option<Server>) -> Self {
        Self(server.map(|server| RefCell::new(ViewerFeed { server, drives: Vec::new(), batch: Batch::default() })))
    }

    /// Notes a frame on its way to the host.
    pub(crate) fn note(&self, passed: Option<BusFrame>) -> Option<BusFrame> {
        if let (Some(shown), Some(passed)) = (&self.0, &passed) {
            shown.borrow_mut().note(passed);
        }
        passed
    }

    /// Hands on what comes, as long as it is awaited.
    pub(crate) fn serve(&self, host: &HostHandle) -> impl Future<Output = Infallible> + use<'_> {
        // Receivers only: a handle would keep the host alive.
        let (states, mut news) = (host.states(), host.news());
        async move {
            let Some(shown) = &self.0 else { return std::future::pending().await };
            let mut interval = tokio::time::interval(HANDED_ON);
            let mut is_over = false;
            loop {
                tokio::select! {
                    _ = interval.tick() => {
                        let state = states.borrow().snapshot();
                        shown.borrow_mut().hand_on(&state);
                    }
                    came = news.recv(), if !is_over => match came {
                        Ok(news) => shown.borrow_mut().batch.marks.push(mark(news)),
                        Err(RecvError::Lagged(missed)) => shown.borrow().server.leave_out(missed as usize),
                        Err(RecvError::Closed) => is_over = true,
                    },
                }
            }
        }
    }
}

impl ViewerFeed {
    fn note(&mut self, passed: &BusFrame) {
        if !self.server.is_watched() {
            return;
        }
        if self.batch.frames.len() < MOST_FRAMES {
            self.batch.frames.push((passed.at, passed.frame));
        } else {
            self.server.leave_out(1);
        }
    }

    /// A drive has its channel before anyone watches; it is sampled, and news are kept, for those who do.
    fn hand_on(&mut self, state: &Snapshot) {
        let is_watched = self.server.is_watched();
        let drives = state.nodes.iter().filter_map(|node| Some((node.node, node.drive.as_deref()?)));
        for (node, drive) in drives {
            let known = self.drives.iter().position(|(known, _)| *known == node);
            let Some(place) = known.or_else(|| self.add(node)) else { continue };
            let width = self.drives.len() * SIGNALS.len();
            let read_at = &mut self.drives[place].1;
            // The same look is shown more than once.
            if is_watched && drive.at_s > *read_at {
                *read_at = drive.at_s;
                let mut row = vec![f64::NAN; width];
                row[place * SIGNALS.len()..][..SIGNALS.len()].copy_from_slice(&values(drive));
                self.batch.rows.push((instant(drive.at_s), row));
            }
        }
        self.batch.rows.sort_by_key(|(at, _)| *at);
        let batch = std::mem::take(&mut self.batch);
        self.server.show(batch);
    }

    /// A channel for a drive that was not there before; its place, unless it has to wait.
    fn add(&mut self, node: u8) -> Option<usize> {
        let names = SIGNALS.iter().map(|signal| format!("{node}.{signal}"));
        let columns: Vec<Column> = names.filter_map(|name| name.parse().ok()).collect();
        self.server.add(&columns).then(|| {
            self.drives.push((node, f64::NEG_INFINITY));
            self.drives.len() - 1
        })
    }
}

/// In the order of [`SIGNALS`]; not a number where the drive has none.
fn values(drive: &DriveView) -> [f64; SIGNALS.len()] {
    let DriveView { velocity_rpm, angle_degrees, current_a, supply_v, motor_celsius, driver_celsius, .. } = drive;
    let output_angle_rad = angle_degrees.map(f64::to_radians);
    [*velocity_rpm, output_angle_rad, *current_a, *supply_v, *motor_celsius, *driver_celsius]
        .map(|value| value.unwrap_or(f64::NAN))
}

fn mark(News { time_s, node, text }: News) -> Mark {
    let of = node.map_or_else(String::new, |node| format!("node {node}"));
    Mark { at: instant(time_s), of: of.into(), kind: "".into(), severity: Severity::Note, text }
}

fn instant(seconds: f64) -> Instant {
    Instant::ZERO + Duration::try_from_secs_f64(seconds).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use foxglove::Options;
    use futures_util::{SinkExt, StreamExt};
    use host::NodeView;
    use host::session::channel;
    use host::trace::{Origin, Trace};
    use recording::Channels;
    use serde_json::Value;
    use tokio::net::TcpStream;
    use tokio_tungstenite::tungstenite::Message;
    use tokio_tungstenite::tungstenite::client::IntoClientRequest;
    use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};

    use super::*;

    type Viewer = WebSocketStream<MaybeTlsStream<TcpStream>>;

    /// Ends when the channels that the texts advertise are all there: topic to number.
    async fn advertised(viewer: &mut Viewer, topics: &[&str]) -> BTreeMap<String, u64> {
        let mut known = BTreeMap::new();
        while !topics.iter().all(|topic| known.contains_key(*topic)) {
            let text = viewer.next().await.expect("open").expect("a message").into_text().expect("a text");
            let message: Value = serde_json::from_str(&text).expect("JSON");
            for channel in message["channels"].as_array().into_iter().flatten() {
                let topic = channel["topic"].as_str().expect("a topic").to_owned();
                known.insert(topic, channel["id"].as_u64().expect("a number"));
            }
        }
        known
    }

    /// A message: its channel, which is subscribed to by its own number, its time in ns, and what it says.
    type Said = (u64, u64, Vec<u8>);

    /// The next message of a channel; those of others are kept in `others`.
    async fn next_of(viewer: &mut Viewer, others: &mut Vec<Said>, channel: u64) -> (u64, Vec<u8>) {
        loop {
            if let Some(place) = others.iter().position(|(of, ..)| *of == channel) {
                let (_, nanos, data) = others.remove(place);
                return (nanos, data);
            }
            let Message::Binary(data) = viewer.next().await.expect("open").expect("a message") else { continue };
            if data[0] == 1 {
                let of = u32::from_le_bytes(data[1..5].try_into().expect("four bytes"));
                let nanos = u64::from_le_bytes(data[5..13].try_into().expect("eight bytes"));
                others.push((of.into(), nanos, data[13..].to_vec()));
            }
        }
    }

    #[tokio::test]
    async fn a_viewer_of_a_host_gets_frames_readings_and_news_and_how_much_was_left_out() {
        let server = Server::start("127.0.0.1:0", Options::default(), Channels::exact(&[])).expect("a free port");
        let mut request = format!("ws://{}", server.address()).into_client_request().expect("an address");
        request.headers_mut().insert("sec-websocket-protocol", "foxglove.sdk.v1".parse().expect("a value"));
        let (mut viewer, _) = connect_async(request).await.expect("let in");
        let (handle, inbox) = channel(Trace::new(master::Models::default(), Origin::default()));
        let viewers = HostViewers::new(Some(server));
        let showing = viewers.serve(&handle);
        let read_at = |at_s| {
            let drive = DriveView { at_s, velocity_rpm: Some(60.0), ..DriveView::default() };
            let node = NodeView { node: 4, drive: Some(Box::new(drive)), ..NodeView::default() };
            let state = Snapshot { nodes: vec![node], ..Snapshot::default() };
            inbox.states.send(state.into()).expect("it is looked at");
        };
        read_at(1.5);
        let passed = |at| BusFrame { at, frame: "184#3C".parse().expect("a frame"), own: false };
        let watched = || viewers.0.as_ref().expect("a server").borrow().server.is_watched();
        let watching = async {
            let known = advertised(&mut viewer, &["/node/4"]).await;
            // Not for this one, which does not watch yet.
            viewers.note(Some(passed(Instant::from_secs(1))));
            let pairs: Vec<_> =
                known.values().map(|number| serde_json::json!({ "id": number, "channelId": number })).collect();
            let all = serde_json::json!({ "op": "subscribe", "subscriptions": pairs });
            viewer.send(Message::text(all.to_string())).await.expect("sent");
            while !watched() {
                tokio::task::yield_now().await;
            }
            viewers.note(Some(passed(Instant::from_secs(2))));
            let news = |text: &str| News { time_s: 2.5, node: Some(4), text: text.to_owned() };
            inbox.news.send(news("it was stopped")).expect("it is heard");
            let mut others = Vec::new();
            let (frame, _) = next_of(&mut viewer, &mut others, known["/can"]).await;
            let (mark, text) = next_of(&mut viewer, &mut others, known["/events"]).await;
            assert_eq!((frame, mark), (2_000_000_000, 2_500_000_000), "not what came before");
            assert!(String::from_utf8_lossy(&text).contains("it was stopped"));
            // The newest reading was made before anyone watched.
            read_at(3.0);
            let (nanos, values) = next_of(&mut viewer, &mut others, known["/node/4"]).await;
            let first = f64::from_le_bytes(values[4..12].try_into().expect("eight bytes"));
            assert_eq!((nanos, first), (1_500_000_000, 60.0));
            // More than a piece holds, and more news than wait for a receiver.
            for _ in 0..MOST_FRAMES + 10 {
                viewers.note(Some(passed(Instant::from_secs(3))));
            }
            for count in 1..=300 {
                inbox.news.send(news(if count < 300 { "again" } else { "the end" })).expect("it is heard");
            }
            let mut left_out = 0;
            loop {
                match viewer.next().await.expect("open").expect("a message") {
                    Message::Text(text) => {
                        let message: Value = serde_json::from_str(&text).expect("JSON");
                        let said = message["message"].as_str().expect("a text");
                        if said.contains("samples, frames and events were left out") {
                            left_out += said.split(' ').next().expect("a number").parse::<usize>().expect("a number");
                        }
                    }
                    Message::Binary(data) if String::from_utf8_lossy(&data).contains("the end") => break,
                    _ => {}
                }
            }
            // Of the news 256 wait.
            assert_eq!(left_out, 10 + 44);
        };
        tokio::select! {
            () = watching => {}
            never = showing => match never {},
        }
    }
}
