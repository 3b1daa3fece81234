//! Looking at what is in a world, and operating its drives.

use can::{Bitrate, Instant};

use super::member::Member;
use super::{Digest, FrameLog, StationId, World, WorldError};
use crate::fault::NodeFaults;
use crate::machine::Realism;
use crate::recorder::{LiveValues, Recorder};
use crate::stimulus::{Place, Stimulus, WireFault};
use crate::wire::{ControllerOptions, ErrorCounters, Statistics};
use crate::{Refused, Report, VirtualDrive};

impl World {
    /// Operates the drive added under `number`: inputs, loads, faults, power.
    pub fn with_drive<T>(
        &mut self,
        number: u8,
        operate: impl FnOnce(&mut dyn VirtualDrive, Instant) -> T,
    ) -> Result<T, WorldError> {
        let id = self.drive_id(number).ok_or(WorldError::NoSuchDrive(number))?;
        self.settle(id.0);
        let Member::Drive { drive, .. } = &mut self.members[id.0] else {
            return Err(WorldError::NoSuchDrive(number));
        };
        let result = operate(&mut **drive, self.now);
        self.serve(id.0);
        self.keep_events();
        Ok(result)
    }

    /// Does to a node what the outer world may do, and notes it in the recording.
    ///
    /// # Errors
    /// [`WorldError::NoSuchDrive`], or what the node does not take; nothing is changed then.
    pub fn apply(&mut self, place: Place, stimulus: &Stimulus) -> Result<Result<(), Refused>, WorldError> {
        let Place { node, axis } = place;
        let applied = match stimulus {
            Stimulus::CableCut(cut) => {
                let id = self.drive_id(node).ok_or(WorldError::NoSuchDrive(node))?;
                if *cut {
                    self.cut(id)
                } else {
                    self.join(id)
                }
                Ok(())
            }
            Stimulus::Bus(fault) => {
                let id = self.drive_id(node).ok_or(WorldError::NoSuchDrive(node))?;
                let mut faults = self.node_faults(id).clone();
                fault.put_into(&mut faults);
                self.set_node_faults(id, faults);
                Ok(())
            }
            stimulus => self.with_drive(node, |drive, now| drive.apply(axis, stimulus, now))?,
        };
        if applied.is_ok() {
            if let Some(recorder) = &mut self.recorder {
                recorder.note(self.now, place, stimulus);
            }
            self.note_stimulus(place, stimulus);
        }
        Ok(applied)
    }

    /// Disturbs the wire; other disturbances stay.
    pub fn disturb(&mut self, fault: WireFault) {
        let corruption = self.bus.corruption_mut();
        match fault {
            WireFault::Corrupt(probability) => corruption.set_probability(probability),
            WireFault::Destroy { nth, bit } => corruption.strike_nth(nth, bit),
        }
    }

    /// What can be measured at the drive added under `number`, now.
    pub fn report(&mut self, number: u8) -> Result<Report, WorldError> {
        self.with_drive(number, |drive, now| {
            drive.advance(now);
            drive.report()
        })
    }

    /// Switches the supply of the drive added under `number`: see [`VirtualDrive::set_power`].
    pub fn set_power(&mut self, number: u8, on: bool) -> Result<(), WorldError> {
        self.with_drive(number, |drive, now| drive.set_power(on, now))?;
        self.look_at_drive(number)
    }

    /// Makes the drive added under `number` as it is calculated, or as one on a bench. The world's seed decides its noise.
    pub fn set_realism(&mut self, number: u8, realism: Realism) -> Result<(), WorldError> {
        let seed = crate::seeds::noise_seed(self.seed, number);
        self.has_chance |= realism == Realism::Full;
        self.with_drive(number, |drive, now| drive.set_realism(realism, seed, now))
    }

    /// Takes supply and charge from the drive added under `number`: it is dead at once.
    pub fn cut_power(&mut self, number: u8) -> Result<(), WorldError> {
        self.with_drive(number, |drive, now| drive.cut_power(now))?;
        self.look_at_drive(number)
    }

    /// The station of the drive added under `number`.
    pub fn drive_id(&self, number: u8) -> Option<StationId> {
        let is_it = |member: &Member| matches!(member, Member::Drive { number: it, .. } if *it == number);
        self.members.iter().position(is_it).map(StationId)
    }

    /// The numbers under which drives were added, in that order.
    pub fn drive_numbers(&self) -> impl Iterator<Item = u8> + '_ {
        self.members.iter().filter_map(|member| match member {
            Member::Drive { number, .. } => Some(*number),
            _ => None,
        })
    }

    /// The number of the drive that answers to a Modbus unit identifier; `None` if none does, or if two would at once
    /// and garble each other's answers.
    pub fn modbus_drive(&mut self, unit: u8) -> Option<u8> {
        self.settle_all();
        let mut answering = self.members.iter_mut().filter_map(|member| match member {
            Member::Drive { number, drive } => {
                drive.advance(self.now);
                (drive.modbus_unit() == Some(unit)).then_some(*number)
            }
            _ => None,
        });
        answering.next().filter(|_| answering.next().is_none())
    }

    /// A station as what it is; `None` if it is something else.
    pub fn station<S: 'static>(&self, id: StationId) -> Option<&S> {
        match &self.members[id.0] {
            Member::Station(station) => (**station).as_any().downcast_ref(),
            _ => None,
        }
    }

    /// A station as what it is, to change it; call [`refresh`](Self::refresh) afterwards.
    pub fn station_mut<S: 'static>(&mut self, id: StationId) -> Option<&mut S> {
        match &mut self.members[id.0] {
            Member::Station(station) => (**station).as_any_mut().downcast_mut(),
            _ => None,
        }
    }

    /// The bit rate of the bus.
    pub fn bitrate(&self) -> Bitrate {
        self.bus.bitrate()
    }

    /// Error counters of a station's controller.
    pub fn counters(&self, id: StationId) -> ErrorCounters {
        self.bus.counters(id.0)
    }

    /// Frames a station lost to overrun.
    pub fn overruns(&self, id: StationId) -> u64 {
        self.bus.overruns(id.0)
    }

    /// Frames, errors and bus load so far.
    pub fn statistics(&self) -> Statistics {
        self.bus.statistics(self.now)
    }

    /// What happened on the wire.
    pub fn log(&self) -> &FrameLog {
        &self.log
    }

    /// What happened on the wire, to pull it or to set how much is kept.
    pub fn log_mut(&mut self) -> &mut FrameLog {
        &mut self.log
    }

    /// What is wrong with a station's access to the bus.
    pub fn node_faults(&self, id: StationId) -> &NodeFaults {
        self.bus.faults(id.0)
    }

    /// True while a station's cable is cut.
    pub fn is_cut(&self, id: StationId) -> bool {
        self.bus.is_cut(id.0)
    }

    /// True while the cable of the sender of a [`WireEvent`](crate::wire::WireEvent) is cut: the event is on a wire of its own.
    pub fn is_source_cut(&self, source: usize) -> bool {
        self.bus.is_cut(source)
    }

    /// True if a station was taken off the bus for good.
    pub fn is_gone(&self, id: StationId) -> bool {
        matches!(self.members[id.0], Member::Gone(_))
    }

    /// Records with `recorder` from now on; a recorder that was here before is lost.
    pub fn start_recording(&mut self, mut recorder: Recorder) {
        recorder.start(self.now);
        self.recorder = Some(recorder);
    }

    /// The recorder at work.
    pub fn recorder(&self) -> Option<&Recorder> {
        self.recorder.as_ref()
    }

    /// Hands out what was recorded since the last call, while recording goes on.
    pub fn take_recorded(&mut self) -> Option<Recorder> {
        self.recorder.as_mut().map(Recorder::take)
    }

    /// What this world's host can sample while it runs.
    pub fn live_values(&mut self) -> LiveValues {
        self.live.handle()
    }

    /// The number of the drive that has this node-ID now.
    pub(super) fn number_of(&mut self, node: u8) -> Option<u8> {
        let has = |world: &mut Self, number: u8| {
            let report = world.measure(Place::node(number));
            report.is_some_and(|report| report.node == node)
        };
        // Mostly it is the one that it was added under.
        if has(self, node) {
            return Some(node);
        }
        let numbers: Vec<u8> = self.drive_numbers().collect();
        numbers.into_iter().find(|number| has(self, *number))
    }

    /// Notes in the recording that something happened now.
    pub fn mark(&mut self, text: &str) {
        if let Some(recorder) = &mut self.recorder {
            recorder.mark(self.now, text);
        }
    }

    /// Ends recording and hands the samples out.
    pub fn stop_recording(&mut self) -> Option<Recorder> {
        self.recorder.take()
    }

    /// Hash over all frames with their times, over the present shaft angles and over where machines are that drives move together.
    pub fn digest(&mut self) -> Digest {
        self.settle_all();
        let mut digest = self.digest;
        digest.bytes(&self.now.as_nanos().to_le_bytes());
        for member in &mut self.members {
            if let Member::Drive { drive, .. } = member {
                drive.advance(self.now);
                digest.bytes(&drive.report().shaft_angle_rad.to_bits().to_le_bytes());
            }
        }
        for bits in self.body_bits() {
            digest.bytes(&bits.to_le_bytes());
        }
        digest
    }

    fn look_at_drive(&mut self, number: u8) -> Result<(), WorldError> {
        let StationId(i) = self.drive_id(number).ok_or(WorldError::NoSuchDrive(number))?;
        self.look_at(i);
        Ok(())
    }

    pub(super) fn add(&mut self, member: Member, options: ControllerOptions) -> StationId {
        if let Some(watch) = &mut self.watch {
            watch.get_to_know(self.members.len(), &member);
        }
        self.members.push(member);
        self.due.push();
        StationId(self.bus.add(options))
    }
}
