//! A world that reports what happens in it, if asked to.

use std::sync::Arc;

use super::World;
use super::watch::WorldWatch;
use crate::events::{Event, EventKind};
use crate::stimulus::{Place, Stimulus};
use crate::wire::WireEvent;

impl World {
    /// Notes events from now on, for [`poll_event`](Self::poll_event), or no longer. What waits to be pulled is dropped when
    /// watching ends.
    pub fn watch(&mut self, on: bool) {
        if !on {
            self.watch = None;
        } else if self.watch.is_none() {
            let mut watch = WorldWatch::default();
            (0..self.members.len()).for_each(|i| watch.get_to_know(i, &self.members[i]));
            self.watch = Some(Box::new(watch));
        }
    }

    /// Whether events are noted.
    pub fn is_watched(&self) -> bool {
        self.watch.is_some()
    }

    /// The oldest event that has not been pulled.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.watch.as_mut()?.pull(self.now)
    }

    /// Who is behind the stimuli from here on, for those who watch: a client's name, `scenario`; `None` for no one in
    /// particular.
    pub fn act_as(&mut self, who: Option<Arc<str>>) {
        if let Some(watch) = &mut self.watch {
            watch.actor = who;
        }
    }

    /// Reports something that only the caller knows of to those who watch.
    pub fn tell(&mut self, place: Option<Place>, kind: EventKind) {
        let at = self.now;
        if let Some(watch) = &mut self.watch {
            watch.push(Event { at, place, kind });
        }
    }

    /// Looks at station `i`, if the world is watched and it is a drive.
    #[inline]
    pub(super) fn look_at(&mut self, i: usize) {
        if let Some(watch) = &mut self.watch {
            watch.look_at(i, &self.members[i], self.now);
        }
    }

    /// After a stimulus: notes it, and after it what has come of it.
    pub(super) fn note_stimulus(&mut self, place: Place, stimulus: &Stimulus) {
        let Some(watch) = &mut self.watch else { return };
        let kind = EventKind::Stimulus { words: stimulus.to_string().into(), by: watch.actor.clone() };
        watch.push(Event { at: self.now, place: Some(place), kind });
        if let Stimulus::CableCut(cut) = stimulus {
            watch.push(Event { at: self.now, place: Some(place), kind: EventKind::Cable(*cut) });
        }
        if let Some(id) = self.drive_id(place.node) {
            self.look_at(id.0);
        }
    }

    /// Takes over what the wire reports.
    pub(super) fn note_wire(&mut self, event: &WireEvent) {
        if let Some(watch) = &mut self.watch {
            watch.hear(event, &self.members);
        }
    }
}
