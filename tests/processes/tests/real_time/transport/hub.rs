//! The servers as clients see them: over real sockets, with clients that behave and clients that do not.

use std::time::Duration;

use super::{PATIENCE, Raw, frame, heard, hub, slcan, slcan_port, socketcand, socketcand_port, soon};
use can::{Frame, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpSocket, TcpStream};
use transport::{
    AsyncBus, BusError, BusSpec, ClientId, Hub, HubError, HubEvent, HubOptions, LeaveReason, Note, Received, ServeSpec,
    SlcanBus, SocketcandBus, WallClock,
};

/// Runs the hub as a bus without arbitration, in the background of the test's runtime.
fn run(mut hub: Hub) {
    tokio::spawn(async move { while AsyncBus::recv(&mut hub).await.is_ok() {} });
}

async fn next_frame(hub: &mut Hub, clock: &WallClock) -> (ClientId, Frame) {
    loop {
        if let HubEvent::Frame { client, frame } = soon(clock, hub.next_event()).await {
            return (client, frame);
        }
    }
}

async fn left(hub: &mut Hub, clock: &WallClock) -> LeaveReason {
    loop {
        if let HubEvent::Left { reason, .. } = soon(clock, hub.next_event()).await {
            return reason;
        }
    }
}

#[tokio::test]
async fn every_client_hears_all_others_and_never_itself() {
    let clock = WallClock::start();
    let hub = hub(&clock).await;
    let (by_socketcand, by_slcan) = (socketcand_port(&hub), slcan_port(&hub));
    run(hub);
    let mut a = socketcand(by_socketcand, &clock).await;
    let mut b = socketcand(by_socketcand, &clock).await;
    let mut c = slcan(by_slcan, &clock).await;
    let mut d = slcan(by_slcan, &clock).await;
    let sent = [frame("604#4041600000000000"), frame("080#"), frame("0000ABCD#0102"), frame("184#R3")];
    for round in 0..50 {
        a.send(&sent[round % 4]).await.unwrap();
        b.send(&sent[(round + 1) % 4]).await.unwrap();
        c.send(&sent[(round + 2) % 4]).await.unwrap();
        d.send(&sent[(round + 3) % 4]).await.unwrap();
        let mut got = [Vec::new(), Vec::new(), Vec::new(), Vec::new()];
        for _ in 0..3 {
            got[0].push(heard(&mut a, &clock).await);
            got[1].push(heard(&mut b, &clock).await);
            got[2].push(heard(&mut c, &clock).await);
            got[3].push(heard(&mut d, &clock).await);
        }
        for (listener, frames) in got.iter().enumerate() {
            let own = sent[(round + listener) % 4];
            assert!(sent.iter().all(|frame| frames.contains(frame) == (*frame != own)), "{listener} heard {frames:?}");
        }
    }
    assert_eq!(c.frames_refused() + c.lines_malformed(), 0);
}

#[tokio::test]
async fn the_owner_decides_when_a_frame_is_heard() {
    let clock = WallClock::start();
    let mut hub = hub(&clock).await;
    let address = socketcand_port(&hub);
    let (mut sender, mut listener) = tokio::join!(Raw::connect(address, &clock), Raw::connect(address, &clock));
    sender.enter_raw_mode().await;
    listener.enter_raw_mode().await;
    sender.say(b"< send 601 1 A >< send 602 1 B >").await;
    let (client, first) = next_frame(&mut hub, &clock).await;
    let (_, second) = next_frame(&mut hub, &clock).await;
    hub.broadcast(&frame("000#0104"), Instant::from_micros(1), None);
    hub.broadcast(&second, Instant::from_micros(1_000_002), Some(client));
    hub.broadcast(&first, Instant::from_micros(3_000_000), Some(client));
    let all = listener.read_until("601").await;
    assert_eq!(all, "< frame 000 0.000001 0104 >< frame 602 1.000002 0B >< frame 601 3.000000 0A >");
    assert_eq!(sender.read_until("000").await, "< frame 000 0.000001 0104 >");
}

#[tokio::test]
async fn greetings_are_never_joined_with_frames_on_a_busy_bus() {
    let clock = WallClock::start();
    let hub = hub(&clock).await;
    let address = socketcand_port(&hub);
    let ticker = clock.clone();
    tokio::spawn(async move {
        loop {
            hub.broadcast(&frame("181#0011223344556677"), ticker.now(), None);
            ticker.sleep(Duration::from_micros(100)).await;
        }
    });
    for _ in 0..20 {
        let mut client = Raw::connect(address, &clock).await;
        client.enter_raw_mode().await;
        assert!(client.read_once().await.starts_with("< frame 181 "));
    }
}

#[tokio::test]
async fn a_client_may_ask_for_everything_in_one_go() {
    let clock = WallClock::start();
    let mut hub = hub(&clock).await;
    let mut client = Raw::connect(socketcand_port(&hub), &clock).await;
    client.say(b"< open can0 >< rawmode >\n< send 123 2 0a ff  >< echo >").await;
    assert_eq!(next_frame(&mut hub, &clock).await.1, frame("123#0AFF"));
    assert_eq!(client.read_until("echo >").await, "< hi >< ok >< ok >< echo >");
}

#[tokio::test]
async fn an_unknown_bus_is_refused_and_the_reason_arrives() {
    let clock = WallClock::start();
    let hub = hub(&clock).await;
    let mut client = Raw::connect(socketcand_port(&hub), &clock).await;
    client.say(b"< open can1 >< rawmode >< send 1 0 >").await;
    let all = client.read_until("error").await;
    assert_eq!(all, "< hi >< error no bus 'can1' here; this server has 'can0' >");
    assert_eq!(client.read_once().await, "");
    let refused = SocketcandBus::connect(&socketcand_port(&hub).to_string(), "can1", &clock).await.unwrap_err();
    assert!(refused.to_string().contains("refused 'open can1': no bus 'can1' here"), "{refused}");
}

#[tokio::test]
async fn garbage_half_lines_and_broken_connections_disturb_nobody() {
    let clock = WallClock::start();
    let mut hub = hub(&clock).await;
    let (by_socketcand, by_slcan) = (socketcand_port(&hub), slcan_port(&hub));
    let mut witness = Raw::connect(by_socketcand, &clock).await;
    witness.enter_raw_mode().await;
    let garbage: Vec<u8> = (0..20_000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    for address in [by_socketcand, by_slcan] {
        for bytes in [&garbage[..], b"< send 123 8 1", b"t1238", b"<<<<<>>>>>", b"\r\r\r\x07\0"] {
            let mut client = Raw::connect(address, &clock).await;
            client.say(bytes).await;
            // Closed with unread replies: the server sees a reset, not an end.
            drop(client);
            assert!(matches!(left(&mut hub, &clock).await, LeaveReason::Closed | LeaveReason::Broken));
        }
    }
    hub.broadcast(&frame("701#05"), Instant::ZERO, None);
    assert_eq!(witness.read_until(">").await, "< frame 701 0.000000 05 >");
    assert_eq!(hub.client_count(), 1);
}

#[tokio::test]
async fn what_a_client_sends_before_it_hangs_up_still_counts() {
    let clock = WallClock::start();
    let mut hub = hub(&clock).await;
    let mut client = TcpStream::connect(slcan_port(&hub)).await.unwrap();
    let burst = b"t123102\r".repeat(200);
    client.write_all(&[b"O\r", &burst[..], b"t12"].concat()).await.unwrap();
    client.shutdown().await.unwrap();
    for _ in 0..200 {
        let (sender, sent) = next_frame(&mut hub, &clock).await;
        assert_eq!(sent, frame("123#02"));
        hub.discard(sender);
    }
    assert_eq!(left(&mut hub, &clock).await, LeaveReason::Closed);
}

#[tokio::test]
async fn a_client_faster_than_the_bus_is_slowed_down() {
    let clock = WallClock::start();
    let mut hub = hub(&clock).await;
    let mut client = Raw::connect(socketcand_port(&hub), &clock).await;
    client.say(b"< open can0 >").await;
    client.say(&b"< send 123 0 >".repeat(500)).await;
    let (id, _) = next_frame(&mut hub, &clock).await;
    for _ in 1..64 {
        next_frame(&mut hub, &clock).await;
    }
    // All 64 are under way, so nothing more comes, however long one waits.
    clock.sleep(Duration::from_millis(50)).await;
    assert_eq!(hub.try_next_event(), None);
    for _ in 64..500 {
        hub.broadcast(&frame("123#"), clock.now(), Some(id));
        next_frame(&mut hub, &clock).await;
    }
}

#[tokio::test]
async fn a_client_that_never_reads_is_dropped_and_holds_up_nobody() {
    let clock = WallClock::start();
    let mut hub = hub(&clock).await;
    let address = socketcand_port(&hub);
    let mut reader = socketcand(address, &clock).await;
    let socket = TcpSocket::new_v4().unwrap();
    socket.set_recv_buffer_size(4096).unwrap();
    let mut sleeper = socket.connect(address).await.unwrap();
    sleeper.write_all(b"< open can0 >< rawmode >< send 1 0 >").await.unwrap();
    next_frame(&mut hub, &clock).await;
    let start = clock.now();
    let dropped = loop {
        for _ in 0..100 {
            hub.broadcast(&frame("181#0011223344556677"), clock.now(), None);
        }
        for _ in 0..100 {
            heard(&mut reader, &clock).await;
        }
        if let Some(HubEvent::Left { reason, .. }) = hub.try_next_event() {
            break reason;
        }
        assert!(clock.now() - start < PATIENCE, "the sleeper is still there");
    };
    assert_eq!(dropped, LeaveReason::TooSlow);
    assert_eq!(hub.client_count(), 1);
    hub.broadcast(&frame("701#05"), clock.now(), None);
    assert_eq!(heard(&mut reader, &clock).await, frame("701#05"));
}

#[tokio::test]
async fn idle_clients_make_room_and_those_that_listen_go_last() {
    let clock = WallClock::start();
    let mut hub = hub(&clock).await;
    let address = socketcand_port(&hub);
    let mut listener = Raw::connect(address, &clock).await;
    listener.enter_raw_mode().await;
    let mut idle = Vec::new();
    for _ in 1..256 {
        let mut client = Raw::connect(address, &clock).await;
        assert_eq!(client.read_once().await, "< hi >");
        idle.push(client);
    }
    assert_eq!(hub.client_count(), 256);
    // The one that was silent for the longest has spoken since, so the second goes.
    idle[0].say(b"< echo >").await;
    assert_eq!(idle[0].read_once().await, "< echo >");
    let mut late = Raw::connect(address, &clock).await;
    late.enter_raw_mode().await;
    assert_eq!(left(&mut hub, &clock).await, LeaveReason::Displaced);
    assert_eq!(hub.client_count(), 256);
    assert_eq!(idle[1].read_once().await, "");
    idle[0].say(b"< echo >").await;
    assert_eq!(idle[0].read_once().await, "< echo >");
    hub.broadcast(&frame("701#05"), Instant::ZERO, None);
    assert_eq!(listener.read_until(">").await, "< frame 701 0.000000 05 >");
    assert_eq!(late.read_until(">").await, "< frame 701 0.000000 05 >");
}

#[tokio::test]
async fn a_closed_slcan_channel_and_bcm_mode_hear_nothing() {
    let clock = WallClock::start();
    let hub = hub(&clock).await;
    let mut closed = Raw::connect(slcan_port(&hub), &clock).await;
    let mut bcm = Raw::connect(socketcand_port(&hub), &clock).await;
    closed.say(b"V\r").await;
    assert_eq!(closed.read_until("\r").await, "V1001\r");
    bcm.say(b"< open can0 >").await;
    assert_eq!(bcm.read_until("ok >").await, "< hi >< ok >");
    hub.broadcast(&frame("701#05"), Instant::ZERO, None);
    closed.say(b"Z1\rO\rV\r").await;
    assert_eq!(closed.read_until("V1001\r").await, "\r\rV1001\r");
    bcm.say(b"< echo >").await;
    assert_eq!(bcm.read_until("echo >").await, "< echo >");
    hub.broadcast(&frame("702#05"), Instant::from_millis(61_002), None);
    assert_eq!(closed.read_until("\r").await, "t70210503EA\r");
}

#[tokio::test]
async fn dropping_the_hub_ends_every_connection() {
    let clock = WallClock::start();
    let hub = hub(&clock).await;
    let mut client = socketcand(socketcand_port(&hub), &clock).await;
    let address = socketcand_port(&hub);
    drop(hub);
    let error = soon(&clock, client.recv()).await.unwrap_err();
    assert!(matches!(error, BusError::Closed { .. } | BusError::Lost { .. }), "{error}");
    let gone = async {
        while TcpStream::connect(address).await.is_ok() {
            clock.sleep(Duration::from_millis(1)).await;
        }
    };
    soon(&clock, gone).await;
}

#[tokio::test]
async fn errors_name_the_place_and_the_reason() {
    let clock = WallClock::start();
    let hub = hub(&clock).await;
    let taken: ServeSpec = format!("slcan://{}", slcan_port(&hub)).parse().unwrap();
    let error = Hub::bind(std::slice::from_ref(&taken), HubOptions::default(), &clock).await.unwrap_err();
    assert!(matches!(&error, HubError::Listen { place, .. } if *place == taken));
    assert!(error.to_string().contains(&taken.to_string()), "{error}");

    let free = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = free.local_addr().unwrap().to_string();
    let greeter = tokio::spawn(async move {
        let (mut stream, _) = free.accept().await.unwrap();
        stream.write_all(b"SSH-2.0-OpenSSH_9.2\r\n").await.unwrap();
    });
    let error = SocketcandBus::connect(&address, "can0", &clock).await.unwrap_err();
    assert!(matches!(error, BusError::Malformed { .. }), "{error}");
    greeter.await.unwrap();
    let error = SlcanBus::connect(&address, None, &clock).await.unwrap_err();
    assert!(error.to_string().contains(&address) && matches!(error, BusError::Connect { .. }), "{error}");
}

#[tokio::test]
async fn closing_an_slcan_bus_closes_its_channel() {
    let clock = WallClock::start();
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let spec: BusSpec = format!("slcan://{}?bitrate=250k", listener.local_addr().unwrap()).parse().unwrap();
    let adapter = async {
        let (mut stream, _) = listener.accept().await.unwrap();
        stream.write_all(b"\x07\r\rV1013\r").await.unwrap();
        let mut reported = vec![0; 10];
        stream.read_exact(&mut reported).await.unwrap();
        stream.write_all(b"\r\r").await.unwrap();
        stream.read_to_end(&mut reported).await.unwrap();
        String::from_utf8(reported).unwrap()
    };
    let host = async { spec.open(&clock).await.unwrap().close().await.unwrap() };
    let (reported, ()) = soon(&clock, async { tokio::join!(adapter, host) }).await;
    assert_eq!(reported, "\r\rC\rV\rS5\rO\rF\rC\r");
}

/// The frames from another bus, and to it, for a test.
struct Other {
    heard: tokio::sync::mpsc::Receiver<Result<Received, BusError>>,
    sent: tokio::sync::mpsc::UnboundedSender<Frame>,
}

impl AsyncBus for Other {
    async fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        let _ = self.sent.send(*frame);
        Ok(())
    }

    async fn recv(&mut self) -> Result<(Instant, Received), BusError> {
        match self.heard.recv().await {
            Some(received) => Ok((Instant::ZERO, received?)),
            None => std::future::pending().await,
        }
    }
}

#[tokio::test]
async fn a_bus_that_is_joined_is_a_client_until_it_ends() {
    let clock = WallClock::start();
    let mut hub = hub(&clock).await;
    let (say, heard_there) = tokio::sync::mpsc::channel(1);
    let (sent, mut sent_there) = tokio::sync::mpsc::unbounded_channel();
    let (reported, mut notes) = tokio::sync::mpsc::unbounded_channel();
    let ended = hub.join(Other { heard: heard_there, sent }, move |note| drop(reported.send(note.clone())));
    assert_eq!(hub.client_count(), 1);
    say.send(Ok(frame("604#40").into())).await.unwrap();
    let (client, from_there) = next_frame(&mut hub, &clock).await;
    assert_eq!(from_there, frame("604#40"));
    // It does not hear its own frame, but that of another.
    hub.broadcast(&from_there, clock.now(), Some(client));
    hub.broadcast(&frame("584#43"), clock.now(), None);
    assert_eq!(soon(&clock, sent_there.recv()).await, Some(frame("584#43")));
    say.send(Ok(Note::Restarted.into())).await.unwrap();
    assert_eq!(soon(&clock, notes.recv()).await, Some(Note::Restarted));
    say.send(Err(BusError::Closed { address: "there".into() })).await.unwrap();
    assert_eq!(soon(&clock, ended).await.to_string(), "there closed the connection");
    assert_eq!(left(&mut hub, &clock).await, LeaveReason::Broken);
    assert_eq!(hub.client_count(), 0);
}

/// A bus takes 64 frames at a time from another one, and the rest when the wire has carried those.
#[tokio::test]
async fn a_bus_that_is_joined_is_read_no_faster_than_the_wire_carries() {
    let clock = WallClock::start();
    let mut hub = hub(&clock).await;
    let (say, heard_there) = tokio::sync::mpsc::channel(1);
    let (sent, _sent_there) = tokio::sync::mpsc::unbounded_channel();
    let _ended = hub.join(Other { heard: heard_there, sent }, |_| {});
    let talker = tokio::spawn(async move {
        for _ in 0..200 {
            say.send(Ok(frame("080#").into())).await.unwrap();
        }
    });
    let mut frames = Vec::new();
    for _ in 0..64 {
        frames.push(next_frame(&mut hub, &clock).await);
    }
    for _ in 0..100 {
        tokio::task::yield_now().await;
    }
    assert!(hub.try_next_event().is_none(), "a 65th frame came before the wire had carried one");
    for carried in 0..200 {
        let (client, frame) = frames[carried];
        hub.broadcast(&frame, clock.now(), Some(client));
        if frames.len() < 200 {
            frames.push(next_frame(&mut hub, &clock).await);
        }
    }
    talker.await.unwrap();
}

/// One that takes nothing is given up when more frames wait for it than for any other client.
#[tokio::test]
async fn a_bus_that_is_joined_and_takes_nothing_is_given_up() {
    struct Stuck;
    impl AsyncBus for Stuck {
        async fn send(&mut self, _frame: &Frame) -> Result<(), BusError> {
            std::future::pending().await
        }

        async fn recv(&mut self) -> Result<(Instant, Received), BusError> {
            std::future::pending().await
        }
    }
    let clock = WallClock::start();
    let mut hub = hub(&clock).await;
    let ended = hub.join(Stuck, |_| {});
    for _ in 0..20_000 {
        hub.broadcast(&frame("080#"), clock.now(), None);
    }
    let error = soon(&clock, ended).await;
    assert!(error.to_string().contains("more slowly than they come"), "{error}");
    assert_eq!(left(&mut hub, &clock).await, LeaveReason::TooSlow);
}
