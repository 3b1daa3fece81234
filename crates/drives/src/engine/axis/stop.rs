use super::task::{Braking, Stop, StopEnd, StopState};

/// A stop under way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stopping {
    pub(super) stop: Stop,
    /// How long the ramp has been over, s.
    over_for_s: f64,
    /// The shaft has come to rest.
    pub(super) held: bool,
    /// The power stage is off.
    pub(super) free: bool,
}

impl Stopping {
    pub(super) const fn new(stop: Stop) -> Self {
        Self { stop, over_for_s: 0.0, held: false, free: false }
    }

    /// One period after the ramp's end; true if the shaft is held from now on.
    pub(super) fn wait(&mut self, standing: bool, dt_s: f64) -> bool {
        self.over_for_s += dt_s;
        self.held = standing || self.over_for_s > self.stop.patience_s;
        self.held
    }

    /// Another stop takes over: true if it is already as far as this one is.
    pub(super) fn replace(&mut self, stop: Stop) -> bool {
        let same = (stop.braking, stop.on_path) == (self.stop.braking, self.stop.on_path);
        let goes_on = if self.free { Self { stop, ..*self }.is_to_be_free() } else { same || self.held };
        if goes_on {
            self.stop = stop;
        }
        goes_on
    }

    /// The motor is to be free: it coasts, or it was held and is let go.
    pub(super) fn is_to_be_free(&self) -> bool {
        self.stop.braking == Braking::Coast || (self.held && self.stop.end == StopEnd::LetGo)
    }

    pub(super) const fn state(&self) -> StopState {
        match *self {
            Self { free: true, .. } => StopState::Free,
            Self { held: true, .. } => StopState::Held,
            _ => StopState::Braking,
        }
    }
}
