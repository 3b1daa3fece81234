//! A host and its conversation with one page, in the thread of their caller.

use std::collections::VecDeque;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use can::{BusFrame, Listen};
use futures_util::stream::poll_fn;
use host::page::{Said, Word, serve};
use host::{Host, HostHandle, Setting};
use master::Network;
use sim::task::Task;
use tokio::sync::mpsc;

use crate::requests::{Request, Response, respond};

/// The page is the one of this module: no other can send a message.
const WORD: &str = "page";

/// Messages of the page that wait: each is taken when it comes.
const WAITING: usize = 64;

type PageTask = Task<Pin<Box<dyn Future<Output = ()>>>>;

/// See the [module](self).
pub(crate) struct Hosted {
    handle: HostHandle,
    hosting: PageTask,
    conversation: Option<Conversation>,
    sent: Vec<String>,
}

/// The session of the page.
struct Conversation {
    work: PageTask,
    said: mpsc::Sender<Said>,
    sending: mpsc::Receiver<String>,
}

impl Hosted {
    /// A host on a network that the caller runs, with the frames that have passed it; no page yet.
    pub(crate) fn new(network: Network, setting: Setting, passed: PassedFrames) -> Self {
        let (host, handle) = Host::new(network, setting);
        let hosting = Task::new(boxed(host.run(move || passed.lock().pop_front())));
        Self { handle, hosting, conversation: None, sent: Vec::new() }
    }

    pub(crate) const fn handle(&self) -> &HostHandle {
        &self.handle
    }

    /// Begins the conversation with the page anew: what it moved in the one before is stopped, as with any end of a connection.
    pub(crate) fn join(&mut self) {
        self.leave();
        let (said, mut saying) = mpsc::channel(WAITING);
        let (to_page, sending) = mpsc::channel(1);
        let page = self.handle.clone();
        let work = async move {
            let Some(session) = page.join().await else { return };
            let word = Word { text: WORD.into(), is_same: |a, b| a == b };
            serve(&page, session, word, poll_fn(move |context| saying.poll_recv(context)), to_page).await;
        };
        self.conversation = Some(Conversation { work: Task::new(boxed(work)), said, sending });
    }

    /// Ends the conversation, if there is one: what the page moved is stopped.
    pub(crate) fn leave(&mut self) -> bool {
        self.sent.clear();
        self.conversation.take().is_some()
    }

    /// The page is in control of the drives, by the newest state.
    pub(crate) fn is_controlled(&self) -> bool {
        self.conversation.is_some() && self.handle.states().borrow().snapshot().controller.is_some()
    }

    /// Hands on a message of the page, as it would send it over the studio's socket. Without a conversation it is lost.
    pub(crate) fn say(&mut self, message: &str) {
        if let Some(page) = &self.conversation {
            // There is room: the conversation takes each at once.
            let _ = page.said.try_send(Said::Text(message.to_owned()));
        }
    }

    /// What the page is to be sent since the last call: JSON objects, the first one the welcome.
    pub(crate) fn take_sent(&mut self) -> Vec<String> {
        std::mem::take(&mut self.sent)
    }

    /// What a request of the page is answered.
    pub(crate) fn request(&self, request: &Request, body: &[u8]) -> Response {
        respond(&self.handle, request, body)
    }

    /// Has host and page do what they can do now; whether that was anything, which the network has to be looked at for.
    pub(crate) fn poll(&mut self) -> bool {
        let mut polled = self.hosting.poll_if_woken().is_some();
        if let Some(page) = &mut self.conversation {
            polled |= page.work.poll_if_woken().is_some();
            while let Ok(message) = page.sending.try_recv() {
                self.sent.push(message);
            }
        }
        polled
    }
}

fn boxed(future: impl Future<Output = ()> + 'static) -> Pin<Box<dyn Future<Output = ()>>> {
    Box::pin(future)
}

/// The frames that have passed the master since the host has taken them.
#[derive(Clone, Default)]
pub(crate) struct PassedFrames(Arc<Mutex<VecDeque<BusFrame>>>);

impl PassedFrames {
    fn lock(&self) -> MutexGuard<'_, VecDeque<BusFrame>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Listen for PassedFrames {
    fn hear(&mut self, passed: BusFrame) {
        self.lock().push_back(passed);
    }
}
