//! Buses over UDP, on this machine: cannelloni between two of ours and a plain socket, python-can's multicast among ours.
#![allow(clippy::print_stderr, reason = "a test that is skipped says why")]

use std::net::SocketAddr;

use super::{frame, heard, soon};
use tokio::net::UdpSocket;
use transport::{AsyncBus, BusError, BusSpec, CannelloniBus, Note, Received, UdpMulticastBus, WallClock};

async fn free_port() -> u16 {
    UdpSocket::bind("127.0.0.1:0").await.unwrap().local_addr().unwrap().port()
}

async fn note(bus: &mut impl AsyncBus, clock: &WallClock) -> Note {
    match soon(clock, bus.recv()).await.unwrap().1 {
        Received::Note(note) => note,
        Received::Frame(frame) => panic!("heard {frame}"),
    }
}

/// A bus, and the other end of its cannelloni as a plain socket.
async fn with_peer(clock: &WallClock) -> (CannelloniBus, UdpSocket, SocketAddr) {
    let peer = UdpSocket::bind("127.0.0.1:0").await.unwrap();
    let port = free_port().await;
    let bus = CannelloniBus::open(&peer.local_addr().unwrap().to_string(), port, clock).await.unwrap();
    (bus, peer, SocketAddr::from(([127, 0, 0, 1], port)))
}

#[tokio::test]
async fn cannelloni_carries_frames_both_ways() {
    let clock = WallClock::start();
    let (one, two) = (free_port().await, free_port().await);
    let open = async |to: u16, at: u16| {
        let spec: BusSpec = format!("cannelloni://127.0.0.1:{to}?local={at}").parse().unwrap();
        spec.open(&clock).await.unwrap()
    };
    let (mut here, mut there) = (open(two, one).await, open(one, two).await);
    for text in ["604#4041600000000000", "1AAAAAAA#01F1", "080#", "704#R1"] {
        here.send(&frame(text)).await.unwrap();
        assert_eq!(heard(&mut there, &clock).await, frame(text));
        there.send(&frame(text)).await.unwrap();
        assert_eq!(heard(&mut here, &clock).await, frame(text));
    }
}

/// The bytes are those of the protocol's description, put down by hand.
#[tokio::test]
async fn a_plain_socket_that_speaks_cannelloni_is_understood() {
    let clock = WallClock::start();
    let (mut bus, peer, at) = with_peer(&clock).await;
    bus.send(&frame("181#AB")).await.unwrap();
    let mut bytes = [0; 64];
    let length = soon(&clock, peer.recv(&mut bytes)).await.unwrap();
    assert_eq!(bytes[..length], [2, 0, 0, 0, 1, 0, 0, 1, 0x81, 1, 0xAB]);
    peer.send_to(&[2, 0, 7, 0, 2, 0, 0, 1, 0x82, 0, 0, 0, 1, 0x83, 1, 5], at).await.unwrap();
    assert_eq!(heard(&mut bus, &clock).await, frame("182#"));
    assert_eq!(heard(&mut bus, &clock).await, frame("183#05"));
    // Number 8 and 9 are missing; then a datagram that was overtaken, which is not a loss.
    peer.send_to(&[2, 0, 10, 0, 0], at).await.unwrap();
    assert_eq!(note(&mut bus, &clock).await, Note::DatagramsLost { count: 2 });
    peer.send_to(&[2, 0, 9, 0, 1, 0, 0, 1, 0x84, 0], at).await.unwrap();
    assert_eq!(heard(&mut bus, &clock).await, frame("184#"));
    peer.send_to(b"hello", at).await.unwrap();
    let torn = note(&mut bus, &clock).await.to_string();
    assert!(torn.contains("'68 65 6c 6c 6f': version 104, expected 2"), "{torn}");
    peer.send_to(&[2, 0, 10, 0, 1, 0, 0, 1, 0x81, 0x80 | 12, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12], at)
        .await
        .unwrap();
    assert!(matches!(note(&mut bus, &clock).await, Note::FdFrame { length: 12, .. }));
}

#[tokio::test]
async fn a_cannelloni_peer_that_is_not_there_is_reported_once_and_may_come() {
    let clock = WallClock::start();
    let (mut bus, peer, at) = with_peer(&clock).await;
    let address = peer.local_addr().unwrap();
    drop(peer);
    let reported = soon(&clock, async {
        loop {
            // What the system says comes with a later call.
            bus.send(&frame("080#")).await.unwrap();
            tokio::select! {
                received = bus.recv() => break received.unwrap().1,
                () = clock.sleep(std::time::Duration::from_millis(10)) => {}
            }
        }
    });
    let reported = reported.await;
    assert!(
        matches!(&reported, Received::Note(Note::ConnectionLost { reason }) if reason.contains("no program listens at 127.0.0.1:"))
    );
    for _ in 0..5 {
        bus.send(&frame("080#")).await.unwrap();
    }
    let peer = UdpSocket::bind(address).await.unwrap();
    peer.send_to(&[2, 0, 0, 0, 1, 0, 0, 1, 0x81, 0], at).await.unwrap();
    assert_eq!(note(&mut bus, &clock).await, Note::ConnectionBack);
    assert_eq!(heard(&mut bus, &clock).await, frame("181#"));
}

#[tokio::test]
async fn a_port_that_is_taken_is_reported() {
    let clock = WallClock::start();
    let taken = UdpSocket::bind("0.0.0.0:0").await.unwrap();
    let port = taken.local_addr().unwrap().port();
    let error = CannelloniBus::open("127.0.0.1:20000", port, &clock).await.unwrap_err();
    assert!(matches!(error, BusError::Listen { .. }), "{error}");
    assert!(error.to_string().contains(&format!("cannot listen at 0.0.0.0:{port}")), "{error}");
    let error = CannelloniBus::open("no.such.host.invalid:20000", 0, &clock).await.unwrap_err();
    assert!(error.to_string().contains("cannot connect to no.such.host.invalid:20000"), "{error}");
}

/// With no hop, so that nothing leaves this machine.
#[tokio::test]
async fn all_who_joined_a_multicast_group_hear_a_frame_but_who_sent_it() {
    let clock = WallClock::start();
    let port = free_port().await;
    let open = || UdpMulticastBus::open([239, 74, 163, 2].into(), port, 0, &clock);
    let mut buses = match [open(), open(), open()] {
        [Ok(one), Ok(two), Ok(three)] => [one, two, three],
        [Err(BusError::Listen { source, .. }), ..] => {
            return eprintln!("skipped: no network of this machine takes a multicast group: {source}");
        }
        other => panic!("{other:?}"),
    };
    let [one, two, three] = &mut buses;
    one.send(&frame("604#40")).await.unwrap();
    assert_eq!(heard(two, &clock).await, frame("604#40"));
    assert_eq!(heard(three, &clock).await, frame("604#40"));
    two.send(&frame("00000604#R2")).await.unwrap();
    // The first thing that the first one hears is not its own frame.
    assert_eq!(heard(one, &clock).await, frame("00000604#R2"));
    assert_eq!(heard(three, &clock).await, frame("00000604#R2"));
    let stranger = UdpSocket::bind("0.0.0.0:0").await.unwrap();
    stranger.set_multicast_ttl_v4(0).unwrap();
    stranger.send_to(b"hello", ("239.74.163.2", port)).await.unwrap();
    assert!(note(one, &clock).await.to_string().contains("no message of python-can"));
}
