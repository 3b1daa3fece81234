//! The watch over the host's heartbeat, 1016h:01 ("M Robot Joint Motor CanOpen Manual", 5.11.1), which the joint keeps by
//! itself.

use can::{Frame, Instant};
use canopen::heartbeat::{Consumer, ConsumerEvent};

/// Which host is listened to, and whether it is missing.
#[derive(Clone, Debug, Default)]
pub(super) struct HostHeartbeat {
    consumer: Option<Consumer>,
    lost: bool,
}

/// What has become of the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum HostEvent {
    Lost,
    Back,
}

impl HostHeartbeat {
    /// The watch begins anew, with the next heartbeat of the node of 1016h:01.
    pub(super) fn configure(&mut self, raw: u32) {
        *self = Self { consumer: Consumer::from_raw(raw), lost: false };
    }

    /// The communication objects are as at power-on; a host that is missing stays so until it is heard.
    pub(super) fn restart_communication(&mut self, raw: u32) {
        self.consumer = Consumer::from_raw(raw);
    }

    pub(super) fn power_off(&mut self) {
        self.consumer = None;
    }

    pub(super) const fn is_lost(&self) -> bool {
        self.lost
    }

    pub(super) fn ignores(&self, frame: &Frame) -> bool {
        self.consumer.is_none_or(|host| frame.id() != host.can_id())
    }

    pub(super) fn handle_frame(&mut self, frame: &Frame, now: Instant) -> Option<HostEvent> {
        let event = self.consumer.as_mut()?.handle_frame(frame, now);
        self.note(event)
    }

    pub(super) fn handle_timeout(&mut self, now: Instant) -> Option<HostEvent> {
        let event = self.consumer.as_mut()?.handle_timeout(now);
        self.note(event)
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.consumer.and_then(|host| host.poll_timeout())
    }

    fn note(&mut self, event: Option<ConsumerEvent>) -> Option<HostEvent> {
        match event? {
            ConsumerEvent::Lost => {
                self.lost = true;
                Some(HostEvent::Lost)
            }
            ConsumerEvent::Heard(_) => core::mem::take(&mut self.lost).then_some(HostEvent::Back),
            ConsumerEvent::BootUp => None,
        }
    }
}
