//! Program download of a described device (CiA 302-3) under any SDO requests.

use std::sync::LazyLock;

use can::{Bitrate, Frame, Instant};
use canopen::{Mux, NodeId, connection_set};
use devices::Description;
use sim::VirtualDrive;
use sim::machine::{Order, order};

const NODE: NodeId = NodeId::new(4).expect("4 is a node-ID");

static DESCRIPTION: LazyLock<&'static Description> = LazyLock::new(|| {
    let array = |index: &str, data_type: &str, access: &str| {
        format!(
            "[{index}]\nParameterName=P{index}\nObjectType=8\nSubNumber=2\n[{index}sub0]\nParameterName=n\nDataType=5\n\
             AccessType=ro\nDefaultValue=1\n[{index}sub1]\nParameterName=P{index} 1\nDataType={data_type}\nAccessType={access}\n"
        )
    };
    let head = "[1000]\nParameterName=Device type\nDataType=7\nAccessType=ro\nDefaultValue=0x30191\n\
                [1001]\nParameterName=Error register\nDataType=5\nAccessType=ro\n";
    let sheet = [
        head,
        &array("1F50", "0xF", "rw"),
        &array("1F51", "5", "rw"),
        &array("1F56", "7", "ro"),
        &array("1F57", "7", "ro"),
    ]
    .concat();
    let eds = eds::Eds::load(sheet.as_bytes()).expect("a sheet of ours").eds;
    eds::keep(&eds).expect("it makes a description")
});

/// Requests of eight bytes, one after the other.
pub(super) const SAMPLES: &[&[u8]] = &[
    // Stop, clear, "123456789" in segments, start.
    b"\x2F\x51\x1F\x01\0\0\0\0\x2F\x51\x1F\x01\x03\0\0\0\x21\x50\x1F\x01\x09\0\0\0\x001234567\x1B89\0\0\0\0\0\x2F\x51\x1F\x01\x01\0\0\0",
    // The same in blocks; CRC-16 of "123456789" is 31C3h.
    b"\x2F\x51\x1F\x01\0\0\0\0\xC6\x50\x1F\x01\x09\0\0\0\x011234567\x8289\0\0\0\0\0\xD5\xC3\x31\0\0\0\0\0\x2F\x51\x1F\x01\x02\0\0\0",
    // What is not allowed: data and a clear while it runs, a state that there is not, a start of nothing.
    b"\x23\x50\x1F\x01abcd\x2F\x51\x1F\x01\x03\0\0\0\x2F\x51\x1F\x01\x07\0\0\0\x2F\x51\x1F\x01\0\0\0\0\x2F\x51\x1F\x01\x03\0\0\0\x2F\x51\x1F\x01\x01\0\0\0",
];

/// Any requests leave a device whose program, identification and status belong together, which runs what is valid only, and
/// which has the same program after a power failure.
pub(super) fn program_download(data: &[u8]) {
    let mut machine = order(*DESCRIPTION, &Order::new(*DESCRIPTION, NODE, Bitrate::M1)).expect("a drive as delivered");
    let mut now = Instant::ZERO;
    machine.set_power(true, now);
    pass(&mut *machine, &mut now);
    for chunk in data.chunks(8) {
        let raw = std::array::from_fn(|at| chunk.get(at).copied().unwrap_or(0));
        ask(&mut *machine, raw, now);
    }
    // What is left of a transfer ends.
    ask(&mut *machine, [0x80, 0, 0, 0, 0, 0, 0, 8], now);
    ask(&mut *machine, [0x80, 0, 0, 0, 0, 0, 0, 8], now);
    let before = shown(&mut *machine, now);
    let [state, identification, status] = before;
    assert!(matches!((state, status), (0, 0 | 2) | (1, 0)), "1F51h {state}, 1F57h {status}");
    assert!(status == 0 || identification == 0, "1F56h {identification:08X}h of no program");
    machine.set_power(false, now);
    pass(&mut *machine, &mut now);
    machine.set_power(true, now);
    pass(&mut *machine, &mut now);
    let after = shown(&mut *machine, now);
    assert_eq!(after[1..], before[1..], "the program is another after a power failure");
    assert_eq!(after[0], u32::from(status == 0), "what is valid runs after power-on");
}

/// Time for a boot.
fn pass(machine: &mut dyn VirtualDrive, now: &mut Instant) {
    for _ in 0..300 {
        *now = now.plus_nanos(10_000_000);
        machine.handle_timeout(*now);
        while machine.poll_transmit().is_some() {}
    }
}

/// A request, and the first answer to it.
fn ask(machine: &mut dyn VirtualDrive, raw: [u8; 8], now: Instant) -> Option<Frame> {
    machine.handle_frame(&Frame::full(connection_set::sdo_request(NODE), raw), now);
    machine.handle_timeout(now);
    let sent: Vec<Frame> = std::iter::from_fn(|| machine.poll_transmit()).take(200).collect();
    assert!(sent.len() < 200, "it never stops sending after {raw:02X?}");
    sent.into_iter().find(|frame| frame.id() == connection_set::sdo_reply(NODE))
}

/// 1F51h, 1F56h and 1F57h.
fn shown(machine: &mut dyn VirtualDrive, now: Instant) -> [u32; 3] {
    [0x1F51, 0x1F56, 0x1F57].map(|index| {
        let Mux { index, sub_index } = Mux::new(index, 1);
        let [low, high] = index.to_le_bytes();
        let answer = ask(machine, [0x40, low, high, sub_index, 0, 0, 0, 0], now).expect("an answer");
        let raw = answer.padded();
        assert_eq!(raw[0] & 0xE0, 0x40, "{answer}");
        u32::from_le_bytes([raw[4], raw[5], raw[6], raw[7]])
    })
}
