//! Bus health beside frames, as reported by the controller and the connection: the run loop of the bus records it here, the host shows it.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::Serialize;

/// News queued for the host; older ones are dropped.
const NEWS: usize = 64;

/// A handle to health and news.
#[derive(Clone, Debug, Default)]
pub struct Wire(Arc<Mutex<Inner>>);

#[derive(Debug, Default)]
struct Inner {
    health: Health,
    news: VecDeque<String>,
}

/// Health of the bus, as far as it is reported.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Health {
    /// Fault confinement of the controller (ISO 11898-1): `error-active`, `bus-off`; `None` where it was not reported.
    pub state: Option<&'static str>,
    /// Its transmit error counter.
    pub transmit_errors: Option<u16>,
    /// Its receive error counter.
    pub receive_errors: Option<u16>,
    /// Error frames so far.
    pub error_frames: u64,
    /// Frames that were lost between the wire and the studio so far, or could not be sent.
    pub frames_lost: u64,
}

impl Wire {
    /// Records the present health.
    pub fn update(&self, change: impl FnOnce(&mut Health)) {
        change(&mut self.lock().health);
    }

    /// Adds news for every page.
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
        // Values are replaced whole: a panic elsewhere leaves them consistent.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
