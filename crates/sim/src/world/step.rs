//! One event after the other.

use can::Instant;
use canopen::connection_set::Service;

use super::crew::Job;
use super::member::Member;
use super::{StationId, World};
use crate::Report;
use crate::stimulus::Place;
use crate::wire::{Delivered, ErrorState, Role, WireEvent};

/// A station that leaves its deadline in the past is asked again after this time: it cannot stop the world.
const OVERDUE_RETRY_NS: u64 = 1_000;

impl World {
    /// Moves to the next event and does all that is due there: frames that end, deadlines, then arbitration.
    ///
    /// False if nothing will ever happen any more unless a stimulus comes from outside.
    pub fn step(&mut self) -> bool {
        let Some(at) = self.next_event() else { return false };
        self.move_to(at);
        if let Some(passed) = self.bus.advance(self.now) {
            self.deliver(&passed);
        }
        self.time_out();
        self.bus.arbitrate(self.now);
        self.keep_events();
        true
    }

    /// When the next event is; `None` for never.
    pub fn next_event(&self) -> Option<Instant> {
        let due = self.due.first().map(|(at, _)| at);
        self.bus.next_event().into_iter().chain(due).min()
    }

    /// Looks again at stations that were changed from outside: what they have to send, when they are due.
    ///
    /// They are given the time first, so that they can count from it.
    pub fn refresh(&mut self) {
        for i in 0..self.members.len() {
            if let Member::Station(station) = &mut self.members[i] {
                station.handle_timeout(self.now);
                self.serve(i);
            }
        }
    }

    /// Lets time pass up to `at`, and takes the samples due on the way as things stand just before `at`.
    pub(super) fn move_to(&mut self, at: Instant) {
        while let Some(due) = self.sample_due_by(at) {
            self.now = self.now.max(due);
            self.work_ahead(Job::Advance, |_, _| true);
            if let Some(mut recorder) = self.recorder.take_if(|recorder| recorder.due_by(due).is_some()) {
                recorder.sample(due, self, Self::measure, Self::body);
                self.recorder = Some(recorder);
            }
            if let Some(values) = self.live.due_at(due) {
                values.sample(self.now, self, Self::measure, Self::number_of);
            }
        }
        self.now = self.now.max(at);
    }

    /// When the next sample is to be taken, if not after `end`.
    fn sample_due_by(&self, end: Instant) -> Option<Instant> {
        let recorder = self.recorder.as_ref().and_then(|recorder| recorder.due_by(end));
        recorder.into_iter().chain(self.live.due_by(end)).min()
    }

    /// What can be measured at an axis of a drive, now; `None` without such a drive. Unlike [`report`](Self::report) it does not
    /// touch the drive: the run stays the same run.
    pub fn measure(&mut self, place: Place) -> Option<Report> {
        if let Some(StationId(i)) = self.drive_id(place.node) {
            self.settle(i);
        }
        let now = self.now;
        self.members.iter_mut().find_map(|member| match member {
            Member::Drive { number, drive } if *number == place.node => {
                drive.advance(now);
                Some(drive.report_of(place.axis))
            }
            _ => None,
        })
    }

    fn deliver(&mut self, passed: &Delivered) {
        self.digest.frame(&passed.frame, passed.end);
        // What most drives take, each of which computes its periods up to now first.
        if matches!(Service::of(passed.frame.id()), Some(Service::Nmt | Service::Sync | Service::Time)) {
            self.work_ahead(Job::Advance, |_, _| true);
        }
        for i in 0..self.members.len() {
            let role = self.bus.conclude(i, passed);
            if role != Role::Nothing {
                self.settle(i);
            }
            match role {
                Role::Transmitted(frame) => self.members[i].station().handle_transmitted(&frame, self.now),
                Role::Received if self.members[i].station().ignores(&passed.frame) => continue,
                Role::Received => {
                    self.forget_held_on_reset(i, &passed.frame);
                    self.members[i].station().handle_frame(&passed.frame, self.now);
                }
                Role::Nothing => continue,
            }
            self.serve(i);
            self.look_at(i);
        }
    }

    fn time_out(&mut self) {
        if self.due.first().is_none_or(|(at, _)| at > self.now) {
            return;
        }
        self.work_ahead(Job::TimeOut, |world, i| world.due.of(i) <= world.now);
        // Who was due is due in the order of numbers; what is due once more in this instant comes after it.
        let mut done = 0;
        while let Some((_, i)) = self.due.first().filter(|(at, _)| *at <= self.now) {
            match self.done_ahead.get(done) {
                Some(&(station, found)) if station == i => {
                    done += 1;
                    self.serve_found(i, found);
                }
                _ => {
                    self.settle(i);
                    self.members[i].station().handle_timeout(self.now);
                    self.serve(i);
                }
            }
            self.look_at(i);
            if self.due.first().is_some_and(|(at, first)| first == i && at <= self.now) {
                self.due.set(i, self.now.plus_nanos(OVERDUE_RETRY_NS));
            }
        }
    }

    /// After any call into station `i`: collects its frames and its deadline.
    pub(super) fn serve(&mut self, i: usize) {
        if let Member::Drive { drive, .. } = &self.members[i] {
            let bitrate = drive.bitrate();
            if bitrate != self.bus.bitrate_of(i) {
                self.bus.restart(i, bitrate, self.now);
                self.forget_held(i);
            }
        }
        self.collect(i);
        let due = self.members[i].station().poll_timeout().unwrap_or(Instant::FAR_FUTURE);
        self.due.set(i, due);
    }

    /// Moves frames from station `i` into its mailboxes, as far as there is room.
    pub(super) fn collect(&mut self, i: usize) {
        while self.bus.has_room(i) {
            let Some(frame) = self.next_frame(i) else { return };
            self.bus.offer(i, frame, self.now);
        }
    }

    pub(super) fn keep_events(&mut self) {
        while let Some(event) = self.bus.poll_event() {
            self.note_wire(&event);
            if let WireEvent::State { controller, state, .. } = event {
                self.members[controller].station().handle_bus_off(state == ErrorState::BusOff, self.now);
                self.serve(controller);
            }
            self.log.push(event);
        }
    }
}
