//! Another bus as a client of a hub: its frames come onto this bus, and what this bus carries goes onto it.

use can::Frame;

use super::client::{Carried, End, Stamped};
use super::event::HubEvent;
use crate::{AsyncBus, BusError, Note, Received};

/// Carries frames both ways until the other bus ends; why it did.
pub(super) async fn serve(mut bus: impl AsyncBus, mut end: End, mut tell: impl FnMut(&Note)) -> BusError {
    // A frame of the other bus for which there is no credit yet: meanwhile that bus is not read.
    let mut waiting: Option<Frame> = None;
    loop {
        tokio::select! {
            credit = end.credits.acquire(), if waiting.is_some() => {
                if let (Ok(credit), Some(frame)) = (credit, waiting.take()) {
                    credit.forget();
                    let _ = end.inbox.send(HubEvent::Frame { client: end.client, frame });
                }
            }
            received = bus.recv(), if waiting.is_none() => match received {
                Ok((_, Received::Frame(frame))) => waiting = Some(frame),
                Ok((_, Received::Note(note))) => tell(&note),
                Err(error) => return error,
            },
            stamped = end.frames.recv() => match stamped {
                // The other bus has error frames of its own.
                Some(Stamped { what: Carried::Error(_), .. }) => {}
                Some(Stamped { what: Carried::Frame(frame), .. }) => {
                    if let Err(error) = bus.send(&frame).await {
                        return error;
                    }
                }
                // The hub has given this client up.
                None => return BusError::TooSlow,
            },
        }
    }
}
