use std::collections::VecDeque;
use std::time::Duration;

use ferrodrive::can::{Bitrate, CanId, Frame, Instant, Station};
use ferrodrive::canopen::NodeId;
use ferrodrive::devices;
use ferrodrive::sim::World;
use ferrodrive::sim::machine::{Order, order};

/// Yours: a controller that writes one object after another, each when the one before was acknowledged.
#[derive(Clone)]
struct Controller {
    to_write: VecDeque<Frame>,
    may_send: bool,
}

impl Station for Controller {
    fn handle_frame(&mut self, frame: &Frame, _now: Instant) {
        let boot_up = frame.id() == CanId::standard(0x704);
        let written = frame.id() == CanId::standard(0x584) && frame.data()[0] == 0x60;
        self.may_send |= boot_up || written;
    }

    fn handle_timeout(&mut self, _now: Instant) {}

    fn poll_transmit(&mut self) -> Option<Frame> {
        let next = self.to_write.front().copied().filter(|_| self.may_send)?;
        self.may_send = false;
        self.to_write.pop_front();
        Some(next)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}

#[test]
fn five_writes_turn_the_wheel() {
    let frames = [
        "604#2F60600003000000", // 6060h = 3: profile velocity
        "604#2B40600006000000", // 6040h = 6: shutdown
        "604#2B40600007000000", // 7: switch on
        "604#2B4060000F000000", // 15: enable operation
        "604#23FF60003C000000", // 60FFh = 60 r/min
    ];
    let to_write = frames.iter().map(|text| text.parse().unwrap()).collect();
    let model = devices::model("zlac8030l").unwrap();
    let node = NodeId::new(4).unwrap();

    let mut world = World::new(Bitrate::K500, 1);
    world.add_station(Controller { to_write, may_send: false });
    world.add_drive(4, order(model, &Order::new(model, node, Bitrate::K500)).unwrap()).unwrap();
    world.run_for(Duration::from_secs(1));
    assert!((world.report(4).unwrap().velocity_rpm - 60.0).abs() < 2.0);

    // No program talks to it any more: a second after the last frame it stops by itself (2000h = 1000 ms as delivered).
    world.run_for(Duration::from_secs(2));
    assert!(world.report(4).unwrap().velocity_rpm.abs() < 2.0);
}
