//! All clients and the channels, in the server's thread.

use std::cell::{Cell, RefCell};
use std::convert::Infallible;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use can::Instant;
use recording::{Batch, Channels, Column, Sink};

use crate::client::Client;
use crate::protocol::{self, Level, Request};
use crate::shared::Shared;

/// See the [module](self).
pub(crate) struct Clients {
    channels: RefCell<Channels>,
    clients: RefCell<Vec<Rc<Client>>>,
    session: String,
    shared: Arc<Shared>,
    is_over: Cell<bool>,
}

/// The clients, as the messages of a batch go to them.
struct Audience<'a>(&'a [Rc<Client>]);

impl Sink for Audience<'_> {
    type Error = Infallible;

    fn message(&mut self, channel: usize, at: Instant, data: &[u8]) -> Result<(), Infallible> {
        self.0.iter().for_each(|client| client.show(channel, at, data));
        Ok(())
    }
}

impl Clients {
    pub(crate) fn new(channels: Channels, session: String, shared: Arc<Shared>) -> Self {
        let (channels, clients, is_over) = (RefCell::new(channels), RefCell::default(), Cell::new(false));
        Self { channels, clients, session, shared, is_over }
    }

    /// Adds a client that has connected, and sends it the server's information and the channels.
    pub(crate) fn join(&self) -> Rc<Client> {
        let client = Rc::new(Client::default());
        client.say(protocol::server_info(&self.session));
        client.say(protocol::advertise(0, self.channels.borrow().list()));
        self.clients.borrow_mut().push(Rc::clone(&client));
        if self.is_over.get() {
            client.end();
        }
        client
    }

    /// It is gone.
    pub(crate) fn leave(&self, client: &Rc<Client>) {
        self.clients.borrow_mut().retain(|known| !Rc::ptr_eq(known, client));
        self.count();
    }

    /// A text of a client; false if it does not read what is said to it.
    pub(crate) fn handle_text(&self, client: &Client, text: &str) -> bool {
        let answers = match protocol::request(text) {
            Err(why) => vec![why],
            Ok(Request::Subscribe(pairs)) => {
                let most = self.channels.borrow().list().len();
                let subscribe = |(subscription, channel): (u32, u64)| match usize::try_from(channel) {
                    Ok(channel) if channel < most => client.subscribe(subscription, channel).err(),
                    _ => Some(format!("unknown channel {channel}: those advertised are 0 to {}", most - 1)),
                };
                pairs.into_iter().filter_map(subscribe).collect()
            }
            Ok(Request::Unsubscribe(numbers)) => {
                numbers.into_iter().filter_map(|number| client.unsubscribe(number).err()).collect()
            }
        };
        self.count();
        answers.into_iter().all(|why| client.say(protocol::status(Level::Error, &why)))
    }

    /// A binary message of a client; false if it does not read what is said to it.
    pub(crate) fn refuse_binary(&self, client: &Client) -> bool {
        let why = "binary messages are not among the capabilities of this server, which only shows";
        client.say(protocol::status(Level::Error, why))
    }

    /// What has happened.
    pub(crate) fn show(&self, batch: &Batch) {
        let clients = self.clients.borrow();
        let mut channels = self.channels.borrow_mut();
        let Ok(()) = batch.give(|entry| channels.encode(entry, &mut Audience(&clients)));
    }

    /// Says something to all clients.
    pub(crate) fn warn(&self, text: &str) {
        self.say_to_all(&protocol::status(Level::Warning, text));
    }

    /// Adds columns to those before.
    pub(crate) fn add(&self, columns: &[Column]) {
        let mut channels = self.channels.borrow_mut();
        let first = channels.list().len();
        channels.add(columns);
        self.say_to_all(&protocol::advertise(first, &channels.list()[first..]));
    }

    fn say_to_all(&self, text: &str) {
        for client in &*self.clients.borrow() {
            // Who has no room for it is sent away for its next request.
            let _ = client.say(text.to_owned());
        }
    }

    /// Nothing more comes.
    pub(crate) fn end(&self) {
        self.is_over.set(true);
        self.clients.borrow().iter().for_each(|client| client.end());
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.clients.borrow().is_empty()
    }

    /// What is not subscribed to need not be sampled.
    fn count(&self) {
        let subscriptions = self.clients.borrow().iter().map(|client| client.subscriptions()).sum();
        self.shared.subscriptions.store(subscriptions, Ordering::Relaxed);
    }
}
