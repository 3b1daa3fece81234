//! Watches over programs that move drives by process data: a program that stays away for some cycles, a drive whose TPDOs
//! stay away, and a SYNC that stays away each end the motion.

use core::fmt;
use std::time::Duration;

use canopen::{Mux, NodeId};

use super::field::ImagePlace;
use super::image::ProcessImage;

/// How a drive that is moved cycle by cycle is stopped, and when.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CycleRules {
    pub(crate) node: NodeId,
    /// The word that stops it.
    pub(crate) stop: u16,
    /// The object that takes the word.
    pub(crate) controlword: Mux,
    /// That object in an RPDO, where it is mapped.
    pub(crate) place: Option<ImagePlace>,
    /// The TPDO that has to come.
    pub(crate) heard: ImagePlace,
    /// How often it comes.
    pub(crate) cadence: Cadence,
    /// Cycles in a row for which the program may stay away, and that TPDO beyond its cadence.
    pub(crate) tolerance: u32,
}

/// How often a TPDO is sent without a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Cadence {
    /// Once in so many cycles of SYNC.
    Cycles(u32),
    /// Once in this time, whatever SYNC does: by its event timer, or as its inhibit time lets it.
    Time(Duration),
}

impl Cadence {
    /// Cycles of SYNC from one to the next, at most.
    pub(crate) fn cycles(self, sync_period: Option<Duration>) -> u64 {
        let nanos = |time: Duration| u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
        match (self, sync_period) {
            (Self::Cycles(cycles), _) => cycles.max(1).into(),
            (Self::Time(time), Some(period)) => nanos(time).div_ceil(nanos(period).max(1)).max(1),
            // Without cycles nothing can be counted in them.
            (Self::Time(_), None) => 1,
        }
    }
}

/// Names a watch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct WatchId(u16);

/// Why a drive that was moved cycle by cycle has been stopped by its master.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CycleLoss {
    /// The program gave no set-point for so many cycles.
    ProgramLate(u64),
    /// The drive's TPDO did not come for so many cycles.
    Silent(u64),
    /// The SYNC of another producer stayed away for this long.
    NoSync(Duration),
    /// The program has commanded all that it moves to stop ([`crate::Network::stop_all_moved`]).
    StopAll,
}

impl fmt::Display for CycleLoss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ProgramLate(cycles) => write!(f, "its program gave no set-point for {cycles} cycles"),
            Self::Silent(cycles) => write!(f, "its TPDO did not come for {cycles} cycles"),
            Self::StopAll => f.write_str("its program stopped all drives"),
            Self::NoSync(time) => write!(f, "no SYNC came for {} ms", time.as_secs_f64() * 1e3),
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct CycleWatch {
    rules: CycleRules,
    state: WatchState,
}

#[derive(Clone, Copy, Debug)]
enum WatchState {
    /// Nothing is in motion.
    Resting,
    /// Since the cycle in which the last set-point was given.
    Moving(u64),
    Stopped(CycleLoss),
}

/// All watches. A watch is never taken away: a node and its controlword have one.
#[derive(Clone, Debug, Default)]
pub(super) struct Supervision {
    watches: Vec<CycleWatch>,
}

impl Supervision {
    /// A watch with these rules, at rest; in place of the one that the same controlword had.
    pub(super) fn set(&mut self, rules: CycleRules) -> WatchId {
        let watch = CycleWatch { rules, state: WatchState::Resting };
        let same = |other: &CycleWatch| (other.rules.node, other.rules.controlword) == (rules.node, rules.controlword);
        let position = self.watches.iter().position(same).unwrap_or(self.watches.len());
        match self.watches.get_mut(position) {
            Some(before) => *before = watch,
            None => self.watches.push(watch),
        }
        WatchId(position as u16)
    }

    /// A set-point was given in this cycle.
    pub(super) fn note_moving(&mut self, id: WatchId, cycle: u64) {
        if let Some(watch) = self.watches.get_mut(usize::from(id.0))
            && !matches!(watch.state, WatchState::Stopped(_))
        {
            watch.state = WatchState::Moving(cycle);
        }
    }

    /// Nothing is in motion any more.
    pub(super) fn note_resting(&mut self, id: WatchId) {
        if let Some(watch) = self.watches.get_mut(usize::from(id.0))
            && let WatchState::Moving(_) = watch.state
        {
            watch.state = WatchState::Resting;
        }
    }

    /// A loss is forgotten.
    pub(super) fn forget_loss(&mut self, id: WatchId) {
        if let Some(watch) = self.watches.get_mut(usize::from(id.0)) {
            watch.state = WatchState::Resting;
        }
    }

    /// Why the drive was stopped, until that is forgotten.
    pub(super) fn loss(&self, id: WatchId) -> Option<CycleLoss> {
        match self.watches.get(usize::from(id.0))?.state {
            WatchState::Stopped(loss) => Some(loss),
            WatchState::Resting | WatchState::Moving(_) => None,
        }
    }

    /// The drives to stop now that this cycle has begun.
    pub(super) fn begin_cycle(
        &mut self,
        number: u64,
        sync_period: Option<Duration>,
        image: &ProcessImage,
    ) -> impl Iterator<Item = (CycleRules, CycleLoss)> {
        self.watches.iter_mut().filter_map(move |watch| {
            let WatchState::Moving(last) = watch.state else { return None };
            let tolerated = u64::from(watch.rules.tolerance);
            let late = number.saturating_sub(last).saturating_sub(1);
            // A TPDO that comes in each cycle came in the one before: nothing is missing yet.
            let since = image.cycles_since(watch.rules.heard).unwrap_or(number);
            let missing = since.saturating_sub(watch.rules.cadence.cycles(sync_period));
            let loss = if late > tolerated {
                CycleLoss::ProgramLate(late)
            } else if missing > tolerated {
                CycleLoss::Silent(since.saturating_sub(1))
            } else {
                return None;
            };
            watch.state = WatchState::Stopped(loss);
            Some((watch.rules, loss))
        })
    }

    /// An axis is being stopped by other means, whether it has been given a set-point or is about to be.
    pub(super) fn stop(&mut self, node: NodeId, controlword: Mux) {
        let same = |watch: &&mut CycleWatch| (watch.rules.node, watch.rules.controlword) == (node, controlword);
        self.watches.iter_mut().filter(same).for_each(|watch| watch.state = WatchState::Stopped(CycleLoss::StopAll));
    }

    /// The drives to stop now that cycles are no longer counted.
    pub(super) fn lose_sync(&mut self, waited: Duration) -> impl Iterator<Item = (CycleRules, CycleLoss)> {
        self.watches.iter_mut().filter_map(move |watch| {
            let WatchState::Moving(_) = watch.state else { return None };
            let loss = CycleLoss::NoSync(waited);
            watch.state = WatchState::Stopped(loss);
            Some((watch.rules, loss))
        })
    }
}
