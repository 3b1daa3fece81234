//! What the controller and the connection say of the bus beside frames: whoever runs the bus puts it down here, the host shows it.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::Serialize;

/// News that wait for the host; older ones are forgotten.
const NEWS: usize = 64;

/// A handle on both.
#[derive(Clone, Debug, Default)]
pub struct Wire(Arc<Mutex<Inner>>);

#[derive(Debug, Default)]
struct Inner {
    health: Health,
    news: VecDeque<String>,
}

/// How the bus is, as far as it tells.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Health {
    /// Fault confinement of the controller (ISO 11898-1): `error-active`, `bus-off`; `None` where nothing was told.
    pub state: Option<&'static str>,
    /// Its transmit error inbox.
    pub transmit_errors: Option<u16>,
    /// Its receive error inbox.
    pub receive_errors: Option<u16>,
    /// Error frames so far.
    pub error_frames: u64,
    /// Frames that were lost between the wire and the studio so far, or could not be sent.
    pub frames_lost: u64,
}

impl Wire {
    /// Puts down what has changed.
    pub fn update(&self, change: impl FnOnce(&mut Health)) {
        change(&mut self.lock().health);
    }

    /// Something that every page is told.
    pub fn tell(&self, text: &str) {
        let news = &mut self.lock().news;
        news.push_back(text.to_owned());
        if news.len() > NEWS {
            news.pop_front();
        }
    }

    pub(crate) fn health(&self) -> Health {
        self.lock().health.clone()
    }

    pub(crate) fn take_news(&self) -> Option<String> {
        self.lock().news.pop_front()
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        // Nothing is half done, whoever panicked.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
