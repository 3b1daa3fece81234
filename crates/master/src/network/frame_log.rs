//! A log of frames that ends with its handle.

use super::handle::Network;
use crate::core::LoggedFrame;

/// Frames of some identifiers with their times, from the moment it is made until it is dropped.
#[derive(Debug)]
pub struct FrameLog {
    network: Network,
    token: u64,
}

impl Network {
    /// Keeps every frame with one of these identifiers, at most `capacity` between two looks: a further one overwrites the oldest.
    pub fn log_frames(&self, ids: &[u16], capacity: usize) -> FrameLog {
        let token = self.with_core(|core| core.frame_logs_mut().open(ids, capacity));
        FrameLog { network: self.clone(), token }
    }
}

impl FrameLog {
    /// Moves what came since the last look to the end of `into`, and says how many frames were lost before that.
    pub fn take(&self, into: &mut Vec<LoggedFrame>) -> u64 {
        self.network.with_core(|core| core.frame_logs_mut().take(self.token, into))
    }
}

impl Drop for FrameLog {
    fn drop(&mut self) {
        self.network.with_core(|core| core.frame_logs_mut().close(self.token));
    }
}
