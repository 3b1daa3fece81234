//! Goes through a scenario in virtual time: from event to event of its world, and to each time that the scenario names.

use can::Instant;
use sim::World;
use sim::events::Event;
use sim::wire::WireEvent;

use super::execution::Execution;
use super::file::Scenario;
use super::occurrence::Occurrence;
use super::outcome::Outcome;
use words::document::BadFile;

/// A run of a scenario: stepped by a caller that looks in between, or [run](Self::run) to its end.
pub struct Runner {
    world: World,
    execution: Execution,
    /// What has happened since it was taken last, for a record.
    kept: Option<Kept>,
}

/// What a record has of a run beside its values.
#[derive(Debug, Default)]
pub struct Kept {
    /// The frames that the bus has carried, each with the time of its last bit.
    pub frames: Vec<(Instant, can::Frame)>,
    /// The events of the world, if it is watched.
    pub events: Vec<Event>,
}

impl Runner {
    /// A run at time zero, with the power just come on. Without a seed it is that of the scenario, of its machine, or 1.
    ///
    /// # Errors
    /// What a drive of the machine does not take.
    pub fn new(scenario: &Scenario, seed: Option<u64>) -> Result<Self, BadFile> {
        let (world, execution) = Execution::begin(scenario, seed)?;
        Ok(Self { world, execution, kept: None })
    }

    /// The present of the run.
    pub fn now(&self) -> Instant {
        self.world.now()
    }

    /// When it ends at the latest.
    pub fn limit(&self) -> Instant {
        self.execution.limit()
    }

    /// The world as it stands.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// The world, to put a recorder into it or to change what no scenario says.
    pub fn world_mut(&mut self) -> &mut World {
        &mut self.world
    }

    /// From now on what happens is kept for [`take_kept`](Self::take_kept).
    pub fn keep(&mut self) {
        self.kept.get_or_insert_default();
    }

    /// What has happened since the last call.
    pub fn take_kept(&mut self) -> Kept {
        self.kept.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// Goes to the end.
    pub fn run(mut self) -> Outcome {
        while self.step() {}
        self.conclude()
    }

    /// Goes on to the next event; false at the end of the run.
    pub fn step(&mut self) -> bool {
        let going = self.execution.go_on(&mut self.world);
        let Some(own) = self.execution.next_time(self.world.now()).filter(|_| going) else { return false };
        match self.world.next_event() {
            Some(at) if at <= own => {
                self.world.step();
                self.hear();
            }
            _ => {
                self.world.run_until(own);
                self.execution.look(&mut self.world);
                self.hear();
            }
        }
        true
    }

    /// Ends the run where it stands, and gives the outcome.
    pub fn conclude(mut self) -> Outcome {
        self.execution.conclude(&mut self.world)
    }

    /// Hands on what has happened, with its consequences.
    fn hear(&mut self) {
        while let Some(event) = self.world.log_mut().pull() {
            if let (WireEvent::Frame { end, frame, .. }, Some(kept)) = (event, &mut self.kept) {
                kept.frames.push((end, frame));
            }
            self.execution.hear(&mut self.world, Occurrence::Wire(&event));
        }
        while let Some(event) = self.world.poll_event() {
            self.execution.hear(&mut self.world, Occurrence::Event(&event));
            if let Some(kept) = &mut self.kept {
                kept.events.push(event);
            }
        }
    }
}
