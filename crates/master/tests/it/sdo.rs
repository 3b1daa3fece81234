//! SDO over several nodes, through the async face, against toy nodes.

use std::future::Future;
use std::pin::Pin;
use std::time::Duration;

use crate::support::toy::Toy;
use crate::support::{Bus, mux, node};
use can::Instant;
use canopen::{AbortCode, NmtState};
use master::core::{Event, Twins};
use master::{Error, Network, join_all};

const DEVICE_TYPE: canopen::Mux = mux(0x1000, 0);
const NAME: canopen::Mux = mux(0x1008, 0);

#[test]
fn three_nodes_are_asked_at_the_same_time() {
    let toys = [1, 2, 4].map(|id| Toy::new(id).u32(0x1000, 0, 0x0004_0192 + u32::from(id)));
    let mut bus = Bus::new(toys.into());
    let network = bus.network.clone();
    let nodes = [1, 2, 4].map(|id| network.node(node(id)));
    let read = bus.block_on(join_all(nodes.iter().map(|node| node.read::<u32>(DEVICE_TYPE))));
    let values: Vec<u32> = read.into_iter().map(Result::unwrap).collect();
    assert_eq!(values, [0x0004_0193, 0x0004_0194, 0x0004_0196]);
    // All three requests were on the wire before the first answer.
    let frames = bus.frames();
    assert!(frames[..3].iter().all(|frame| frame.ends_with("#4000100000000000")), "{frames:?}");
}

#[test]
fn requests_to_one_node_are_queued_and_sent_one_by_one() {
    let mut bus = Bus::new(vec![Toy::new(4).u16(0x6041, 0, 0x0237).u8(0x1001, 0, 0)]);
    let network = bus.network.clone();
    let node = network.node(node(4));
    let reads = [mux(0x6041, 0), mux(0x1001, 0), mux(0x6041, 0)].map(|mux| node.upload(mux));
    let read = bus.block_on(join_all(reads));
    assert_eq!(read[1].as_ref().unwrap().as_bytes(), [0]);
    assert_eq!(read[2].as_ref().unwrap().as_bytes(), [0x37, 0x02]);
    let frames = bus.frames();
    assert_eq!(
        frames,
        [
            "604#4041600000000000",
            "584#4B41600037020000",
            "604#4001100000000000",
            "584#4F01100000000000",
            "604#4041600000000000",
            "584#4B41600037020000",
        ]
    );
}

#[test]
fn segmented_transfers_carry_any_length() {
    for length in [5, 7, 8, 14, 15, 100] {
        let text: Vec<u8> = (0..length).collect();
        let mut bus = Bus::new(vec![Toy::new(9).with(0x1008, 0, &text).with(0x2000, 0, b"")]);
        let network = bus.network.clone();
        let node = network.node(node(9));
        let read = bus.block_on(node.upload(NAME)).unwrap();
        assert_eq!(read.as_bytes(), text);
        bus.block_on(node.download(mux(0x2000, 0), &text)).unwrap();
        assert_eq!(bus.toys[0].objects[&(0x2000, 0)], text);
    }
}

#[test]
fn a_silent_node_times_out_exactly_at_its_deadline() {
    let mut bus = Bus::new(vec![]);
    let network = bus.network.clone();
    let node = network.node(node(4)).with_timeout(Duration::from_millis(200));
    let error = bus.block_on(node.read::<u32>(DEVICE_TYPE)).unwrap_err();
    assert!(matches!(error, Error::NoAnswer { waited, .. } if waited == Duration::from_millis(200)), "{error}");
    // The abort to the server goes out one frame after the deadline; the time was 5 s when it began.
    let (at, abort) = bus.log.last().unwrap();
    assert_eq!(abort.to_string(), "604#8000100000000405");
    assert_eq!(*at - Instant::from_secs(5), Duration::from_micros(200_256));
    assert!(error.to_string().contains("Nothing at all has been heard on the bus"), "{error}");
}

#[test]
fn a_node_that_falls_silent_within_a_segmented_transfer_is_reported() {
    let mut toy = Toy::new(4).with(0x1008, 0, &[b'x'; 50]);
    toy.answers_left = Some(3);
    let mut bus = Bus::new(vec![toy]);
    let network = bus.network.clone();
    let error = bus.block_on(network.node(node(4)).upload(NAME)).unwrap_err();
    let text = error.to_string();
    assert!(text.starts_with("node 4 did not answer within 500 ms when asked to read 1008h:00"), "{text}");
    assert!(text.contains("last heard 500 ms ago"), "{text}");
    assert_eq!(bus.toys[0].aborted_by_client, [AbortCode::TIMED_OUT.0]);
    // The channel is free again.
    bus.toys[0].answers_left = None;
    let network = bus.network.clone();
    assert_eq!(bus.block_on(network.node(node(4)).upload(NAME)).unwrap().as_bytes(), [b'x'; 50]);
}

#[test]
fn an_abort_code_is_handed_on_with_what_to_do() {
    let mut toy = Toy::new(4).u8(0x6060, 0, 0);
    toy.aborts.insert((0x6060, 0), AbortCode::INVALID_VALUE.0);
    let mut bus = Bus::new(vec![toy]);
    let network = bus.network.clone();
    let node = network.node(node(4));
    let error = bus.block_on(node.write(mux(0x6060, 0), 6_i8)).unwrap_err();
    assert!(matches!(error, Error::Aborted { code: AbortCode::INVALID_VALUE, .. }));
    assert_eq!(
        error.to_string(),
        "node 4 refused to write 6060h:00: 0609 0030h (invalid value for parameter). \
         Give a value within the limits of its object dictionary"
    );
    let error = bus.block_on(node.read::<u32>(mux(0x6502, 0))).unwrap_err();
    assert!(matches!(error, Error::Aborted { code: AbortCode::NO_SUCH_OBJECT, .. }));
}

#[test]
fn two_devices_with_one_node_id_are_noticed_by_their_answers() {
    let one = Toy::new(4).u32(0x1000, 0, 0x0004_0192).u16(0x1017, 0, 0);
    let other = Toy::new(4).u32(0x1000, 0, 0x0002_0192);
    let mut bus = Bus::new(vec![one.clone(), other]);
    let network = bus.network.clone();
    let found = bus.block_on(network.scan(Duration::from_millis(50), |_| {}));
    assert!(found.len() == 1 && found[0].twins == Some(Twins::Answers), "{found:?}");
    let events: Vec<Event> = std::iter::from_fn(|| network.poll_event()).map(|(_, event)| event).collect();
    let twice: Vec<_> = events.iter().filter(|event| **event == Event::TwoDevices(node(4), Twins::Answers)).collect();
    assert_eq!(twice.len(), 1, "reported once: {events:?}");
    // One device, asked by this master and by another.
    let mut bus = Bus::new(vec![one]);
    let network = bus.network.clone();
    let asked_by_another = "604#4000100000000000".parse().unwrap();
    for _ in 0..5 {
        bus.noise.push((bus.now, asked_by_another));
        assert!(bus.block_on(network.node(node(4)).read::<u32>(DEVICE_TYPE)).is_ok());
    }
    assert_eq!(network.node(node(4)).facts().second_answers, 0);
    assert_eq!(bus.block_on(network.scan(Duration::from_millis(50), |_| {}))[0].twins, None);
}

/// One of the two is stopped and answers no SDO, or both answer the same at the same time: heartbeats and boot-ups show it.
#[test]
fn two_devices_with_one_node_id_are_noticed_by_what_they_send() {
    let toy = Toy::new(4).u32(0x1000, 0, 0x0004_0192).u16(0x1017, 0, 1000);
    // From 5 s on, when the bus begins.
    let every = |phase: u64, data: &str| {
        let frame: can::Frame = format!("704#{data}").parse().unwrap();
        (0..20).map(move |n| (Instant::from_millis(5000 + phase + n * 1000), frame)).collect::<Vec<_>>()
    };
    let stopped = every(300, "04");
    let ms = Duration::from_millis;
    for (noise, twins) in [
        (every(200, "05"), None),
        ([every(200, "05"), stopped].concat(), Some(Twins::States(NmtState::Stopped, NmtState::Operational))),
        ([every(200, "05"), every(250, "05")].concat(), Some(Twins::Rhythm(ms(50), ms(950)))),
        (vec![every(200, "00")[0], every(203, "00")[0]], Some(Twins::BootUps)),
    ] {
        let mut bus = Bus::new(vec![toy.clone()]);
        bus.noise = noise;
        bus.settle();
        let network = bus.network.clone();
        let found = bus.block_on(network.scan(Duration::from_millis(50), |_| {}));
        assert_eq!(found[0].twins, twins, "{found:?}");
        let limit = if twins.is_some() { 5000 } else { 1700 };
        assert!(bus.now < Instant::from_millis(5000 + limit), "{twins:?} at {}", bus.now);
    }
}

#[test]
fn an_object_of_another_length_is_an_error_and_not_a_number() {
    let mut bus = Bus::new(vec![Toy::new(4).u16(0x606C, 0, 100)]);
    let network = bus.network.clone();
    let error = bus.block_on(network.node(node(4)).read::<i32>(mux(0x606C, 0))).unwrap_err();
    assert!(matches!(error, Error::WrongLength { expected: 4, received: 2, .. }), "{error}");
}

#[test]
fn dropping_a_future_aborts_the_transfer_and_frees_the_channel() {
    let mut toy = Toy::new(4).with(0x1008, 0, &[b'x'; 50]).u16(0x6041, 0, 0x0237);
    toy.answers_left = Some(2);
    let mut bus = Bus::new(vec![toy]);
    let network = bus.network.clone();
    let node = network.node(node(4));
    bus.block_on(async {
        let nap = network.sleep(Duration::from_millis(50));
        let upload = node.upload(NAME);
        // The upload hangs; the nap ends first and the upload is dropped.
        assert!(crate::support::first(nap, upload).await.is_none());
    });
    assert_eq!(bus.toys[0].aborted_by_client.len(), 1);
    bus.toys[0].answers_left = None;
    assert_eq!(bus.block_on(node.read::<u16>(mux(0x6041, 0))).unwrap(), 0x0237);
}

#[test]
fn a_future_that_was_dropped_before_its_turn_never_reaches_the_wire() {
    let mut toy = Toy::new(4).u16(0x6041, 0, 0x0237);
    toy.answers_left = Some(0);
    let mut bus = Bus::new(vec![toy]);
    let network = bus.network.clone();
    let node = network.node(node(4));
    bus.block_on(async {
        let first = node.upload(mux(0x6041, 0));
        let second = node.upload(mux(0x1001, 0));
        let nap = network.sleep(Duration::from_millis(50));
        let both = join_all([first, second]);
        assert!(crate::support::first(nap, both).await.is_none());
    });
    assert!(!bus.frames().iter().any(|frame| frame.starts_with("604#40011000")), "{:?}", bus.frames());
}

#[test]
fn an_answer_about_another_object_is_not_taken_for_the_asked_one() {
    let mut toy = Toy::new(4).u32(0x1000, 0, 7);
    toy.wrong_index = 1;
    let mut bus = Bus::new(vec![toy]);
    let network = bus.network.clone();
    let error = bus.block_on(network.node(node(4)).read::<u32>(DEVICE_TYPE)).unwrap_err();
    assert!(matches!(error, Error::NoAnswer { .. } | Error::BadAnswer { .. }), "{error}");
}

#[test]
fn noise_does_not_disturb_a_transfer() {
    let mut bus = Bus::new(vec![Toy::new(4).with(0x1008, 0, &[b'y'; 200])]);
    let start = bus.now;
    for (n, text) in ["583#4300100001020304", "584#", "584#R8", "00000584#60", "704#", "704#99", "084#01", "184#1122"]
        .iter()
        .cycle()
        .take(64)
        .enumerate()
    {
        bus.noise.push((start + Duration::from_micros(700 * n as u64), text.parse().unwrap()));
    }
    // An empty SDO answer is a broken answer: only the rest is noise to this transfer.
    bus.noise.retain(|(_, frame)| frame.to_string() != "584#");
    let network = bus.network.clone();
    assert_eq!(bus.block_on(network.node(node(4)).upload(NAME)).unwrap().as_bytes(), [b'y'; 200]);
}

#[test]
fn more_requests_than_the_queue_holds_are_refused_at_once() {
    let mut bus = Bus::new(vec![Toy::new(4).u8(0x1001, 0, 0)]);
    let network = bus.network.clone();
    let node = network.node(node(4));
    let outcomes = bus.block_on(join_all((0..200).map(|_| node.upload(mux(0x1001, 0)))));
    let full = outcomes.iter().filter(|outcome| matches!(outcome, Err(Error::QueueFull { .. }))).count();
    assert!(full > 0 && full < 200, "{full}");
    assert!(outcomes.iter().filter(|outcome| outcome.is_ok()).count() + full == 200);
}

#[test]
fn reset_waits_for_the_boot_up_message_and_a_dead_node_is_explained() {
    let mut bus = Bus::new(vec![Toy::new(4)]);
    let network = bus.network.clone();
    bus.block_on(network.node(node(4)).reset(Duration::from_secs(1))).unwrap();
    let error = bus.block_on(network.node(node(5)).reset(Duration::from_secs(1))).unwrap_err();
    assert!(
        error.to_string().starts_with(
            "node 5 did not boot within 1000 ms. Node 4 can be heard on the bus, but this one has never been: check its node-ID"
        ),
        "{error}"
    );
}

#[test]
fn of_a_node_that_is_not_there_the_others_are_named() {
    let answer = |others: u8| {
        let mut toys: Vec<_> = (1..=others).map(Toy::new).collect();
        toys.iter_mut().for_each(|toy| toy.send(0x700, &[0x7F]));
        let mut bus = Bus::new(toys);
        let network = bus.network.clone();
        bus.block_on(network.node(node(50)).read::<u32>(DEVICE_TYPE)).unwrap_err().to_string()
    };
    assert!(answer(0).contains("Nothing at all has been heard"), "{}", answer(0));
    assert!(answer(3).contains("Nodes 1, 2, 3 can be heard"), "{}", answer(3));
    assert!(answer(10).contains("Nodes 1, 2, 3, 4, 5 and 5 more can be heard"), "{}", answer(10));
}

#[test]
fn a_stopped_node_is_reported_as_such() {
    let mut toy = Toy::new(4);
    toy.answers_left = Some(0);
    toy.send(0x700, &[4]);
    let mut bus = Bus::new(vec![toy]);
    let network = bus.network.clone();
    let error = bus.block_on(network.node(node(4)).read::<u32>(DEVICE_TYPE)).unwrap_err();
    assert!(error.to_string().contains("it is stopped, where SDO does not exist"), "{error}");
}

#[test]
fn a_lost_heartbeat_is_seen_by_who_waits_for_it() {
    let mut toy = Toy::new(4);
    toy.send(0x700, &[5]);
    let mut bus = Bus::new(vec![toy]);
    let network = bus.network.clone();
    let node = network.node(node(4));
    node.watch_heartbeat(Some(Duration::from_millis(300)));
    let lost =
        node.wait(|node| node.facts.heartbeat_watch.filter(|watch| watch.lost).map(|_| ()), Duration::from_secs(2));
    assert_eq!(bus.block_on(lost), Ok(()));
    // 300 ms after the heartbeat, which took one frame time from 5 s.
    assert_eq!(bus.now, Instant::from_secs(5) + Duration::from_micros(300_256));
}

#[test]
fn a_node_that_this_master_stopped_is_reported_as_such_without_a_heartbeat() {
    let mut toy = Toy::new(4);
    toy.answers_left = Some(0);
    let mut bus = Bus::new(vec![toy]);
    let network = bus.network.clone();
    let node = network.node(node(4));
    node.nmt(canopen::NmtCommand::Stop);
    let error = bus.block_on(node.read::<u32>(DEVICE_TYPE)).unwrap_err();
    assert!(error.to_string().contains("it is stopped, where SDO does not exist"), "{error}");
}

#[test]
fn a_request_that_the_runner_does_not_take_is_reported_as_such() {
    // No runner takes frames: an interface that is down.
    let mut network = master::Network::new();
    let node = network.node(node(4)).with_timeout(Duration::from_millis(100));
    let mut read = std::pin::pin!(node.read::<u32>(DEVICE_TYPE));
    let mut context = std::task::Context::from_waker(std::task::Waker::noop());
    assert!(read.as_mut().poll(&mut context).is_pending());
    for ms in [0, 100] {
        can::Station::handle_timeout(&mut network, Instant::from_millis(ms));
    }
    let std::task::Poll::Ready(Err(error)) = read.as_mut().poll(&mut context) else { panic!("not ready") };
    assert!(error.to_string().contains("never left this computer"), "{error}");
}

#[test]
fn a_runner_that_sleeps_is_woken_when_something_is_asked_for() {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU32, Ordering};
    struct Count(AtomicU32);
    impl std::task::Wake for Count {
        fn wake(self: Arc<Self>) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }
    }
    let count = Arc::new(Count(AtomicU32::new(0)));
    let waker = std::task::Waker::from(count.clone());
    let mut context = std::task::Context::from_waker(&waker);
    let mut network = master::Network::new();
    assert!(network.poll_activity(&mut context).is_pending());
    network.nmt_all(canopen::NmtCommand::Start);
    assert_eq!(count.0.load(Ordering::Relaxed), 1);
    assert!(network.poll_activity(&mut context).is_ready());
    // Ready once; the command goes out at the runner's next call, for which the deadline asks at once.
    assert!(network.poll_activity(&mut context).is_pending());
    assert_eq!(can::Station::poll_timeout(&network), Some(Instant::ZERO));
    can::Station::handle_timeout(&mut network, Instant::from_secs(1));
    assert_eq!(can::Station::poll_transmit(&mut network).unwrap().to_string(), "000#0100");
    network.on_activity(waker.clone());
    network.sync(None);
    network.sync(None);
    assert_eq!(count.0.load(Ordering::Relaxed), 4, "once for the poll, twice for the lasting waker");
}

#[test]
fn what_is_dropped_before_the_runner_comes_leaves_no_trace() {
    let mut network = master::Network::new();
    let node = network.node(node(4));
    for _ in 0..10_000 {
        let mut read = Box::pin(node.read::<u32>(DEVICE_TYPE));
        let mut context = std::task::Context::from_waker(std::task::Waker::noop());
        assert!(read.as_mut().poll(&mut context).is_pending());
    }
    can::Station::handle_timeout(&mut network, Instant::from_secs(1));
    assert_eq!(can::Station::poll_transmit(&mut network), None);
    assert_eq!(can::Station::poll_timeout(&network), None);
}

/// The toy answers only at its default server: the answers of further ones (CiA 301, 7.2.4.3.5) are on the bus at their time.
#[test]
fn a_request_keeps_its_answer_while_its_server_is_changed_and_the_default_one_needs_no_question() {
    let records = |toy: Toy, (index, id): (u16, u32)| toy.u32(index, 1, id).u32(index, 2, id + 0x10);
    let mut bus = Bus::new(vec![[(0x1201, 0x680), (0x1202, 0x681)].into_iter().fold(Toy::new(4), records)]);
    let node = bus.network.node(node(4));
    let request = |answer: &str, after: u64| (Instant::from_secs(5 + after), answer.parse().unwrap());
    bus.noise = vec![
        request("690#4302120181060000", 1),
        request("690#4300100092010400", 2),
        request("690#4302120291060000", 3),
        request("690#4300100092010400", 4),
    ];
    let node = node.with_timeout(Duration::from_secs(10));
    bus.block_on(async {
        node.use_sdo_server(0x1201).await.unwrap();
        let change = async {
            let server = node.use_sdo_server(0x1202).await.unwrap();
            assert_eq!(server.reply.raw(), 0x691);
            Ok(0)
        };
        // The change comes while the second read, which was queued behind those of the record, waits for its answer at 690h.
        let read = async {
            node.read::<u32>(DEVICE_TYPE).await.unwrap();
            node.read::<u32>(DEVICE_TYPE).await
        };
        type Asked<'a> = Pin<Box<dyn Future<Output = Result<u32, Error>> + 'a>>;
        let both: [Asked<'_>; 2] = [Box::pin(change), Box::pin(read)];
        let read = join_all(both).await;
        assert_eq!(read[1].as_ref().unwrap(), &0x0004_0192);
        assert_eq!(node.use_sdo_server(0x1200).await.unwrap().request.raw(), 0x604);
        assert_eq!(node.read::<u32>(mux(0x1201, 1)).await.unwrap(), 0x680);
    });
}

/// The record of the first choice is read, and its answer is waited for, while another server is chosen: by its own handle, by all at once,
/// and by the way in which the first was chosen.
#[test]
fn a_server_that_is_chosen_while_the_record_of_another_is_read_is_the_one_that_is_used() {
    let toy = || Toy::new(4).u32(0x1201, 1, 0x680).u32(0x1201, 2, 0x690).u32(DEVICE_TYPE.index, 0, 0x0004_0192);
    type Choice = fn(&Network);
    let lazy: Choice = |network| network.choose_sdo_servers([(node(4), 0x1201)]);
    let changes: [(&str, Option<Choice>, bool); 4] = [
        ("read with a request, then the default one", Some(lazy), true),
        ("read with a request, then none", Some(lazy), false),
        ("asked for, then the default one", None, true),
        ("asked for, then none", None, false),
    ];
    for (what, first, by_handle) in changes {
        let mut bus = Bus::new(vec![toy()]);
        let (network, handle) = (bus.network.clone(), bus.network.node(node(4)));
        let asked = async {
            if let Some(choose) = first {
                choose(&network);
                return handle.read::<u32>(DEVICE_TYPE).await.map(drop);
            }
            handle.use_sdo_server(0x1201).await.map(drop)
        };
        let other = async {
            // The first half of the record has been asked for by now.
            network.sleep(Duration::from_micros(1)).await;
            match by_handle {
                true => handle.use_sdo_server(0x1200).await.map(drop),
                false => {
                    network.choose_sdo_servers([]);
                    Ok(())
                }
            }
        };
        bus.block_on(async {
            type Asked<'a> = Pin<Box<dyn Future<Output = Result<(), Error>> + 'a>>;
            let both: [Asked<'_>; 2] = [Box::pin(asked), Box::pin(other)];
            for done in join_all(both).await {
                done.unwrap_or_else(|error| panic!("{what}: {error}"));
            }
            // The toy answers at its default server only.
            assert_eq!(handle.read::<u32>(DEVICE_TYPE).await.ok(), Some(0x0004_0192), "{what}");
        });
        assert!(bus.frames().iter().any(|frame| frame.starts_with("604#40011202")), "{what}: its record was read");
        assert!(!bus.frames().iter().any(|frame| frame.starts_with("680#")), "{what}");
    }
}
