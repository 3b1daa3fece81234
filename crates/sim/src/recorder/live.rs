//! Values of drives for a host while the world runs: samples at a period, kept until the host takes them.
//!
//! The host holds a [`LiveValues`] of its world and begins a [`Subscription`]; the world samples into it whenever its time passes. As
//! with a recorder, machines are looked at without being touched: the run is the same run.

use core::sync::atomic::{AtomicU64, Ordering};
use core::time::Duration;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use can::Instant;

use super::Signal;
use crate::stimulus::Place;
use crate::{AxisId, Report};

/// Samples that are kept until they are taken; further ones are lost and counted.
const MOST: usize = 100_000;

/// `next_at` while nothing is subscribed.
const NEVER: u64 = u64::MAX;

/// A world's values for its host. A clone is another handle to the same world.
#[derive(Clone, Debug)]
pub struct LiveValues(Arc<LiveShared>);

#[derive(Debug)]
struct LiveShared {
    /// When the earliest sample is due in ns of the world's time: what the world looks at when its time passes.
    next_at: AtomicU64,
    state: Mutex<LiveState>,
}

#[derive(Debug, Default)]
struct LiveState {
    feeds: Vec<Feed>,
    next_token: u64,
}

/// What one subscription is about, and its samples.
#[derive(Debug)]
struct Feed {
    token: u64,
    node: u8,
    axis: AxisId,
    signals: Vec<Signal>,
    next_at: Instant,
    period: Duration,
    /// The number under which the drive was added, once it was looked for.
    number: Option<u8>,
    times: Vec<Instant>,
    values: Vec<f64>,
    lost: u64,
    is_missing: bool,
}

/// Signals of one axis at a period, until this is dropped.
#[derive(Debug)]
pub struct Subscription {
    of: LiveValues,
    token: u64,
    width: usize,
}

/// What came since the last look.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    /// When each was taken.
    pub times: Vec<Instant>,
    /// One after the other, each with its signals in the order of the subscription.
    pub values: Vec<f64>,
    /// Samples that found no room.
    pub lost: u64,
    /// No drive of the world has this node-ID.
    pub is_missing: bool,
}

impl PartialEq for LiveValues {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl LiveValues {
    pub(crate) fn new() -> Self {
        Self(Arc::new(LiveShared { next_at: AtomicU64::new(NEVER), state: Mutex::default() }))
    }

    fn lock(&self) -> MutexGuard<'_, LiveState> {
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins to sample an axis of the drive that has this node-ID, from `first_at` on and every `period` (at least
    /// 1 us) from there.
    pub fn subscribe(
        &self,
        (node, axis): (u8, AxisId),
        signals: Vec<Signal>,
        first_at: Instant,
        period: Duration,
    ) -> Subscription {
        let mut state = self.lock();
        state.next_token += 1;
        let (token, width) = (state.next_token, signals.len());
        let (times, values) = (Vec::new(), Vec::new());
        let period = period.max(Duration::from_micros(1));
        let feed = Feed {
            token,
            node,
            axis,
            signals,
            next_at: first_at,
            period,
            number: None,
            times,
            values,
            lost: 0,
            is_missing: false,
        };
        state.feeds.push(feed);
        self.note_next(&state);
        drop(state);
        Subscription { of: self.clone(), token, width }
    }

    fn note_next(&self, state: &LiveState) {
        let next = state.feeds.iter().map(|feed| feed.next_at.as_nanos()).min();
        self.0.next_at.store(next.unwrap_or(NEVER), Ordering::Release);
    }

    /// When the next sample is due, if not after `end`.
    pub(crate) fn due_by(&self, end: Instant) -> Option<Instant> {
        let next = self.0.next_at.load(Ordering::Acquire);
        (next != NEVER && next <= end.as_nanos()).then(|| Instant::from_nanos(next))
    }

    /// Takes the samples that are due at `at`. `measure` gives the report of an axis, `number_of` the number of the drive that has a
    /// node-ID.
    pub(crate) fn sample<W>(
        &self,
        at: Instant,
        world: &mut W,
        measure: impl Fn(&mut W, Place) -> Option<Report>,
        number_of: impl Fn(&mut W, u8) -> Option<u8>,
    ) {
        let mut state = self.lock();
        for feed in state.feeds.iter_mut().filter(|feed| feed.next_at <= at) {
            if feed.number.is_none() {
                feed.number = number_of(world, feed.node);
            }
            feed.is_missing = feed.number.is_none();
            // A host that asks for a time that has passed is not given all that would have been since.
            while feed.next_at <= at {
                feed.next_at += feed.period;
            }
            if feed.times.len() >= MOST {
                feed.lost += 1;
                continue;
            }
            let report = feed.number.and_then(|node| measure(world, Place { node, axis: feed.axis }));
            feed.times.push(at);
            let of = |signal: &Signal| report.as_ref().map_or(f64::NAN, |report| signal.of(report));
            feed.values.extend(feed.signals.iter().map(of));
        }
        self.note_next(&state);
    }
}

impl Subscription {
    /// How many values a sample has.
    pub const fn width(&self) -> usize {
        self.width
    }

    /// Takes what came since the last call.
    pub fn take(&self) -> Samples {
        self.take_until(Instant::FAR_FUTURE)
    }

    /// Takes what came since the last call and is not after a time.
    pub fn take_until(&self, last: Instant) -> Samples {
        let mut state = self.of.lock();
        let Some(feed) = state.feeds.iter_mut().find(|feed| feed.token == self.token) else {
            return Samples::default();
        };
        let count = feed.times.partition_point(|at| *at <= last);
        Samples {
            times: feed.times.drain(..count).collect(),
            values: feed.values.drain(..count * self.width).collect(),
            lost: std::mem::take(&mut feed.lost),
            is_missing: feed.is_missing,
        }
    }
}

impl Drop for Subscription {
    fn drop(&mut self) {
        let mut state = self.of.lock();
        state.feeds.retain(|feed| feed.token != self.token);
        self.of.note_next(&state);
    }
}

/// The place of a world for it. A copy of the world is another world, which no host looks at.
#[derive(Debug, Default)]
pub(crate) struct LivePlace(Option<LiveValues>);

impl Clone for LivePlace {
    fn clone(&self) -> Self {
        Self(None)
    }
}

impl LivePlace {
    /// The handle, made when it is first asked for.
    pub(crate) fn handle(&mut self) -> LiveValues {
        self.0.get_or_insert_with(LiveValues::new).clone()
    }

    pub(crate) fn due_by(&self, end: Instant) -> Option<Instant> {
        self.0.as_ref()?.due_by(end)
    }

    /// The handle, if something is due at `at`.
    pub(crate) fn due_at(&self, at: Instant) -> Option<LiveValues> {
        self.0.as_ref().filter(|values| values.due_by(at).is_some()).cloned()
    }
}
