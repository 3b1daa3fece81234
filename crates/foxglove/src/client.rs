//! What waits for one client: bounded, the oldest data give way.

use std::cell::RefCell;
use std::collections::{BTreeMap, VecDeque};

use can::Instant;
use tokio::sync::Notify;
use tokio_tungstenite::tungstenite::Message;

use crate::protocol::{self, Level};

/// Bytes of data that wait for a client: six seconds of all signals of a drive, each millisecond.
const MOST_BYTES: usize = 2 << 20;

/// Texts that wait for a client: who asks for more without reading is sent away.
const MOST_TEXTS: usize = 256;

/// Of bus time, between two reports of what was lost.
const REPORT_INTERVAL_NANOS: u64 = 1_000_000_000;

/// One client, as its tasks and the hub share it.
#[derive(Default)]
pub(crate) struct Client {
    state: RefCell<ClientState>,
    filled: Notify,
}

#[derive(Default)]
struct ClientState {
    /// Its number of the subscription of each channel.
    subscriptions: BTreeMap<usize, u32>,
    texts: VecDeque<String>,
    data: VecDeque<Vec<u8>>,
    /// In `data`.
    bytes: usize,
    /// Messages that gave way since that was last reported.
    lost: u64,
    reported_at: u64,
    /// The time that it knows, in ns.
    time: Option<u64>,
    /// Nothing more comes.
    is_over: bool,
}

impl Client {
    /// Has a text sent; false if too many wait.
    pub(crate) fn say(&self, text: String) -> bool {
        let mut state = self.state.borrow_mut();
        if state.texts.len() >= MOST_TEXTS {
            return false;
        }
        state.texts.push_back(text);
        self.filled.notify_one();
        true
    }

    /// Subscribes to a channel.
    ///
    /// # Errors
    /// A sentence for the client.
    pub(crate) fn subscribe(&self, subscription: u32, channel: usize) -> Result<(), String> {
        let mut state = self.state.borrow_mut();
        if state.subscriptions.values().any(|known| *known == subscription) {
            return Err(format!("subscription {subscription} is in use: choose another number"));
        }
        if let Some(known) = state.subscriptions.get(&channel) {
            return Err(format!("channel {channel} is subscribed to already, by subscription {known}"));
        }
        state.subscriptions.insert(channel, subscription);
        Ok(())
    }

    /// Ends a subscription.
    ///
    /// # Errors
    /// A sentence for the client.
    pub(crate) fn unsubscribe(&self, subscription: u32) -> Result<(), String> {
        let mut state = self.state.borrow_mut();
        let before = state.subscriptions.len();
        state.subscriptions.retain(|_, known| *known != subscription);
        let is_gone = state.subscriptions.len() < before;
        if is_gone { Ok(()) } else { Err(format!("there is no subscription {subscription}")) }
    }

    pub(crate) fn subscriptions(&self) -> usize {
        self.state.borrow().subscriptions.len()
    }

    /// Has a message of a channel sent, if it is subscribed to.
    pub(crate) fn show(&self, channel: usize, at: Instant, data: &[u8]) {
        let mut state = self.state.borrow_mut();
        let Some(subscription) = state.subscriptions.get(&channel).copied() else { return };
        let nanos = at.as_nanos();
        // Viewers take the server's time as that of what follows; one that goes back has them begin again.
        if state.time.is_none_or(|known| known < nanos) {
            state.time = Some(nanos);
            state.push(protocol::time(nanos));
        }
        state.push(protocol::message_data(subscription, nanos, data));
        if state.lost > 0 && nanos.saturating_sub(state.reported_at) >= REPORT_INTERVAL_NANOS {
            let lost = std::mem::take(&mut state.lost);
            state.reported_at = nanos;
            let text = format!("{lost} messages were left out: this viewer reads more slowly than they come");
            // Whether that finds room makes no difference to what was lost.
            if state.texts.len() < MOST_TEXTS {
                state.texts.push_back(protocol::status(Level::Warning, &text));
            }
        }
        self.filled.notify_one();
    }

    /// Nothing more comes: what waits is still sent.
    pub(crate) fn end(&self) {
        self.state.borrow_mut().is_over = true;
        self.filled.notify_one();
    }

    /// The next that is to be sent, if something waits.
    pub(crate) fn take(&self) -> Option<Message> {
        let mut state = self.state.borrow_mut();
        if let Some(text) = state.texts.pop_front() {
            return Some(Message::text(text));
        }
        let data = state.data.pop_front()?;
        state.bytes -= data.len();
        Some(Message::binary(data))
    }

    /// Waits for something to be sent; `None` when nothing more comes.
    pub(crate) async fn next(&self) -> Option<Message> {
        loop {
            if let Some(message) = self.take() {
                return Some(message);
            }
            if self.state.borrow().is_over {
                return None;
            }
            self.filled.notified().await;
        }
    }
}

impl ClientState {
    fn push(&mut self, message: Vec<u8>) {
        self.bytes += message.len();
        self.data.push_back(message);
        while self.bytes > MOST_BYTES
            && let Some(oldest) = self.data.pop_front()
        {
            self.bytes -= oldest.len();
            self.lost += u64::from(protocol::is_data(&oldest));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(client: &Client) -> Vec<Message> {
        std::iter::from_fn(|| client.take()).collect()
    }

    #[test]
    fn only_what_is_subscribed_to_comes_and_each_time_once() {
        let client = Client::default();
        client.subscribe(7, 2).expect("free");
        assert!(client.subscribe(7, 3).is_err() && client.subscribe(8, 2).is_err());
        let at = Instant::from_nanos(5);
        client.show(1, at, b"no");
        client.show(2, at, b"a");
        client.show(2, at, b"b");
        // One that comes late does not turn the time back.
        client.show(2, Instant::from_nanos(4), b"c");
        let expected = [
            protocol::time(5),
            protocol::message_data(7, 5, b"a"),
            protocol::message_data(7, 5, b"b"),
            protocol::message_data(7, 4, b"c"),
        ];
        assert_eq!(taken(&client), expected.map(Message::binary));
        client.unsubscribe(7).expect("there");
        assert!(client.unsubscribe(7).is_err());
        client.show(2, at, b"d");
        assert!(taken(&client).is_empty());
    }

    #[test]
    fn a_client_that_does_not_read_keeps_the_newest_and_learns_what_it_lost() {
        const SENT: u64 = 10_000;
        let client = Client::default();
        client.subscribe(0, 2).expect("free");
        let data = [0; 1000];
        (1..=SENT).for_each(|millis| client.show(2, Instant::from_millis(millis), &data));
        let (mut lost, mut newest, mut shown) = (0, 0, 0);
        for message in taken(&client) {
            match message {
                Message::Text(text) => {
                    let status: serde_json::Value = serde_json::from_str(&text).expect("JSON");
                    let said = status["message"].as_str().expect("a text");
                    lost += said.split(' ').next().expect("a number").parse::<u64>().expect("a number");
                    assert_eq!((&status["op"], &status["level"]), (&"status".into(), &1.into()), "{text}");
                }
                Message::Binary(data) if protocol::is_data(&data) => {
                    shown += 1;
                    newest = u64::from_le_bytes(data[5..13].try_into().expect("eight bytes"));
                }
                _ => {}
            }
        }
        let not_yet = client.state.borrow().lost;
        assert_eq!(lost + not_yet + shown, SENT);
        assert!(lost > 0 && newest == SENT * 1_000_000, "{lost} lost, the newest at {newest}");
        assert!((1..=MOST_BYTES as u64 / 1000).contains(&shown), "{shown} shown");
        // A flood of texts has an end.
        assert_eq!((0..1000).filter(|_| client.say(String::new())).count(), MOST_TEXTS);
    }
}
