//! What happened in a world: for the program that asks for it, for a record, and the last of it for a report on a test that failed.

use std::collections::VecDeque;

use sim::events::Event;

/// Events that are kept for a report.
const KEPT: usize = 100;

/// The events of a world. They wait in the world, which bounds them, until someone looks.
#[derive(Default)]
pub(super) struct Happened {
    /// A program asks for them.
    asked: bool,
    /// What was looked at for a report, and that program has not taken yet.
    waiting: Vec<Event>,
    /// The last ones, where a report may want them.
    kept: Option<VecDeque<Event>>,
    /// What a record that is being written has not taken yet.
    recorded: Option<Vec<Event>>,
}

impl Happened {
    /// A program asks for what happens from now on, or no longer.
    pub(super) fn watch(&mut self, world: &mut sim::World, on: bool) {
        self.look(world);
        self.waiting.clear();
        self.asked = on;
        self.watch_as_needed(world);
    }

    /// A record takes what happens from now on, or no longer.
    pub(super) fn record(&mut self, world: &mut sim::World, on: bool) {
        self.look(world);
        self.recorded = on.then(Vec::new);
        self.watch_as_needed(world);
    }

    fn watch_as_needed(&self, world: &mut sim::World) {
        world.watch(self.asked || self.kept.is_some() || self.recorded.is_some());
    }

    /// What happened since the last call, for the record.
    pub(super) fn take_for_record(&mut self, world: &mut sim::World) -> Vec<Event> {
        self.look(world);
        self.recorded.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// The last events are kept from now on.
    pub(super) fn keep(&mut self, world: &mut sim::World) {
        self.kept.get_or_insert_default();
        world.watch(true);
    }

    /// What happened since the last call, for the program that asks.
    pub(super) fn take(&mut self, world: &mut sim::World) -> Vec<Event> {
        self.look(world);
        std::mem::take(&mut self.waiting)
    }

    /// The last events, at most so many, oldest first; the program that asks misses none by that.
    pub(super) fn last(&mut self, world: &mut sim::World, most: usize) -> impl Iterator<Item = &Event> {
        self.look(world);
        let kept = self.kept.iter().flatten();
        let all = kept.clone().count();
        kept.skip(all.saturating_sub(most))
    }

    fn look(&mut self, world: &mut sim::World) {
        for event in std::iter::from_fn(|| world.poll_event()) {
            if let Some(kept) = &mut self.kept {
                if kept.len() == KEPT {
                    kept.pop_front();
                }
                kept.push_back(event.clone());
            }
            if let Some(recorded) = &mut self.recorded {
                recorded.push(event.clone());
            }
            if self.asked {
                self.waiting.push(event);
            }
        }
    }
}
