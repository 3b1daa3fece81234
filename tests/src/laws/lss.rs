//! Layer setting services (CiA 305) under any frames: the wire, a server, a client, and both fast searches.

use std::time::Duration;

use can::{Frame, Instant};
use canopen::NodeId;
use canopen::connection_set::{LSS_MASTER, LSS_SLAVE};
use canopen::lss::{Address, Client, FastScan, Reply, Request, Server};

/// A chunk is a byte that says which way a frame goes, how long it is and how long it is waited for, and eight bytes.
pub(super) const SAMPLES: &[&[u8]] = &[
    // Switch to configuration, a node-ID, a bit rate, store, inquire.
    b"\0\x04\x01\0\0\0\0\0\0\0\x11\x09\0\0\0\0\0\0\0\x13\0\x02\0\0\0\0\0\0\x17\0\0\0\0\0\0\0\0\x5E\0\0\0\0\0\0\0",
    // Fastscan, selective switch, identify.
    b"\0\x51\0\0\0\0\x80\0\0\0\x40\x07\0\0\0\0\0\0\0\x46\x07\0\0\0\0\0\0\0\x4C\0\0\0\0\0\0\0",
    // Replies.
    b"\x01\x11\0\0\0\0\0\0\0\x01\x4F\0\0\0\0\0\0\0\x01\x5E\x09\0\0\0\0\0\0",
];

const CHUNK: usize = 9;
const ADDRESS: Address = Address { numbers: [7, 0x1234_5678, 1, 0xFFFF_FFFF] };

/// What is parsed is emitted and parsed the same; a server answers what is answered with what answers it, and has a node-ID or none;
/// a client is satisfied by nothing but an answer to its question.
pub(super) fn lss(data: &[u8]) {
    let mut server = Server::new(ADDRESS, NodeId::new(9));
    let mut client = Client::new(Duration::from_millis(50));
    let mut scan = FastScan::new();
    let mut now = Instant::ZERO;
    for chunk in data.chunks(CHUNK) {
        let byte = |at: usize| chunk.get(at).copied().unwrap_or(0);
        let bytes: [u8; 8] = std::array::from_fn(|at| byte(at + 1));
        let length = if byte(0) & 0x40 == 0 { 8 } else { usize::from(byte(0) / 2 % 8) };
        now = now.plus_nanos(u64::from(byte(0)) * 1_000_000);
        client.handle_timeout(now);
        if byte(0) % 2 == 0 {
            let frame = Frame::new(LSS_MASTER, &bytes[..length]);
            let Some(request) = Request::parse(&frame) else { continue };
            assert_eq!(Request::parse(&request.emit()), Some(request), "{frame}");
            let (reply, _) = server.handle(request);
            if let Some(reply) = reply {
                assert!(request.is_answered() && request.is_answered_by(&reply), "{request:?} got {reply:?}");
                assert_eq!(Reply::parse(&reply.emit()), Some(reply));
                assert_eq!(reply.emit().id(), LSS_SLAVE);
            }
            if !client.is_waiting() && request.is_answered() {
                client.ask(request, now);
                assert_eq!(client.poll_transmit(), Some(request.emit()));
            }
            scan.note(reply.is_some());
            let _ = (scan.next(), scan.found());
        } else {
            let frame = Frame::new(LSS_SLAVE, &bytes[..length]);
            if let Some(reply) = Reply::parse(&frame) {
                assert_eq!(Reply::parse(&reply.emit()), Some(reply), "{frame}");
            }
            let waiting = client.is_waiting();
            assert!(client.handle_frame(&frame).is_none() || waiting, "{frame} answers nothing");
        }
    }
}
