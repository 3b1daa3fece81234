//! Two axes on one node: by CiA 402's index offset of 800h, and at a second sub-index as some makers have it.

use std::time::Duration;

use can::Bitrate;
use canopen::od::{Access, DataType, Entry, FREE_PLACES, RowFacts, Table};
use canopen::{AbortCode, Mux, NodeId};
use devices::servo::{CIA402, MODES, axis};
use devices::{AxisDescription, AxisId, Description, Placement};
use sim::machine::{Order, order as order_machine};
use sim::recorder::{Channel, Recorder, Signal};
use sim::{Place, VirtualDrive, World};

use crate::virtual_cia402::bench::{Bench, TURN};

fn leak<T>(value: T) -> &'static T {
    Box::leak(Box::new(value))
}

fn table(mut rows: Vec<Entry>) -> &'static Table {
    rows.sort_by_key(|row| row.mux().key());
    let rows: &'static [Entry] = rows.leak();
    let (facts, places) = (vec![RowFacts::NONE; rows.len()].leak(), vec![FREE_PLACES; rows.len()].leak());
    leak(Table::at_run_time(rows, facts, places).expect("no object twice"))
}

fn described(name: &'static str, dictionary: &'static Table, axes: Vec<AxisDescription>) -> &'static Description {
    leak(Description { name, dictionary, axes: axes.leak(), ..CIA402 })
}

fn by_offset() -> &'static Description {
    so_many_by_offset("two-axes-by-offset", 2)
}

fn so_many_by_offset(name: &'static str, count: u16) -> &'static Description {
    let rows = CIA402.dictionary.rows();
    let further = (1..count).flat_map(|number| {
        let profile = rows.iter().filter(|row| row.index >= 0x6000);
        profile.map(move |row| Entry { index: row.index + number * 0x800, ..*row })
    });
    let all = rows.iter().copied().chain(further).collect();
    let axes = (0..count).map(|number| axis(Placement::IndexOffset(number * 0x800), MODES)).collect();
    described(name, table(all), axes)
}

/// Each object of sub-index 0 has the first axis at sub-index 1 and the second at 2; records are shared.
fn by_sub_index() -> &'static Description {
    let rows = CIA402.dictionary.rows();
    let is_record = |index: u16| rows.iter().any(|row| row.index == index && row.sub_index > 0);
    let placed = rows.iter().flat_map(|row| {
        let twice = row.index >= 0x6000 && row.sub_index == 0 && !is_record(row.index);
        let at = if twice { vec![1, 2] } else { vec![row.sub_index] };
        at.into_iter().map(|sub_index| Entry { sub_index, ..*row })
    });
    let side = |sub_index| axis(Placement::SubIndex { sub_index, shared: &[] }, MODES);
    // What is mapped as delivered is elsewhere here.
    let unmapped = placed.map(|row| match row.index {
        0x1600..=0x1603 | 0x1A00..=0x1A03 => row.default(0),
        _ => row,
    });
    described("two-axes-by-sub-index", table(unmapped.collect()), vec![side(1), side(2)])
}

/// Enables both axes in profile velocity and turns them apart.
fn check(mut bench: Bench) {
    let description = bench.machine.firmware().description();
    let axes = description.axes;
    let place = |axis: usize, index: u16| {
        let Mux { index, sub_index } = axes[axis].placement.place(Mux::new(index, 0));
        (index, sub_index)
    };
    for (axis, speed) in [(0, 10), (1, -5)] {
        let write = |bench: &mut Bench, index, value| {
            let (index, sub) = place(axis, index);
            bench.set(&[(index, sub, value)]);
        };
        write(&mut bench, 0x6060, 3);
        for word in [0x06, 0x07, 0x0F] {
            write(&mut bench, 0x6040, word);
        }
        write(&mut bench, 0x60FF, speed * TURN);
    }
    bench.run_ms(500);
    for (axis, rpm) in [(0, 600.0), (1, -300.0)] {
        let motor = bench.machine.assembly().motor(axis).unwrap();
        let turning = motor.rotor.velocity_rad_s * 60.0 / std::f64::consts::TAU;
        assert!((turning - rpm).abs() < 8.0, "axis {axis}: {turning}");
        let (index, sub) = place(axis, 0x606C);
        assert!((bench.read(index, sub) as f64 / TURN as f64 * 60.0 - rpm).abs() < 8.0, "axis {axis}");
    }
    // A quick stop of one leaves the other alone.
    let (index, sub) = place(1, 0x6040);
    bench.set(&[(index, sub, 0x02)]);
    bench.run_ms(300);
    let speed = |bench: &Bench, axis| bench.machine.assembly().motor(axis).unwrap().rotor.velocity_rad_s;
    assert!(speed(&bench, 0) > 60.0 && speed(&bench, 1).abs() < 0.5);
    let (index, sub) = place(1, 0x6041);
    assert_eq!(bench.read(index, sub) & 0x4F, 0x40);
}

#[test]
fn two_axes_800h_apart_run_apart() {
    check(Bench::of(by_offset()));
}

#[test]
fn eight_axes_run_each_at_its_own_speed_and_refuse_what_their_own_objects_refuse() {
    let mut bench = Bench::of(so_many_by_offset("eight-axes", 8));
    for number in 0..8 {
        let at = |index: u16| index + number * 0x800;
        bench.set(&[(at(0x6060), 0, 3), (at(0x6040), 0, 6), (at(0x6040), 0, 7), (at(0x6040), 0, 15)]);
        bench.set(&[(at(0x60FF), 0, (i64::from(number) + 1) * TURN)]);
        assert_eq!(
            bench.write(at(0x6060), 0, 5),
            Err(AbortCode::INVALID_VALUE),
            "6502h of axis {number} has no mode 5"
        );
    }
    bench.run_ms(500);
    for number in 0..8 {
        let shown = bench.machine.report_of(AxisId(number)).velocity_rpm;
        assert!((shown - 60.0 * (f64::from(number) + 1.0)).abs() < 3.0, "axis {number}: {shown}");
    }
    // A fault of one axis is its own.
    sim::VirtualDrive::apply(
        &mut bench.machine,
        AxisId(4),
        &sim::Stimulus::Fault(sim::Component::Encoder, true),
        bench.now,
    )
    .unwrap();
    bench.run_ms(50);
    for number in 0..8 {
        let at = |index: u16| index + number * 0x800;
        let status = bench.read(at(0x6041), 0);
        let expected = if number == 4 { (0x08, 0x7305) } else { (0x07, 0) };
        assert_eq!((status & 0x4F, bench.read(at(0x603F), 0)), expected, "axis {number}: {status:04X}");
    }
    assert_eq!(bench.machine.inputs().len(), 40);
}

/// Two axes of a drive of the profile's first edition, which has velocity factor 1 too: 6095h, as delivered 1/60.
fn with_velocity_factor_1() -> &'static Description {
    let rows = by_offset().dictionary.rows().iter().copied();
    let factor = [0x6095, 0x6895].into_iter().flat_map(|index| {
        let entry =
            |sub, data_type, access, default| Entry::new(index, sub, data_type, access, "", "").default(default);
        [
            entry(0, DataType::Unsigned8, Access::ReadOnly, 2),
            entry(1, DataType::Unsigned32, Access::ReadWrite, 1),
            entry(2, DataType::Unsigned32, Access::ReadWrite, 60),
        ]
    });
    let axes = by_offset().axes.to_vec();
    described("two-axes-of-the-first-edition", table(rows.chain(factor).collect()), axes)
}

#[test]
fn velocity_factor_1_says_how_fast_the_highest_speed_of_the_motor_is() {
    // DSP 402 V2.0, velocity factor 1: highest velocity [user] = 6080h [r/min] * 6095h. Velocities are in position units of a
    // TURN a turn, per second.
    let mut bench = Bench::of(with_velocity_factor_1());
    for axis in [0, 0x800] {
        let at = |index: u16| index + axis;
        for sub in [1, 2] {
            assert_eq!(bench.write(at(0x6095), sub, 0), Err(AbortCode::VALUE_TOO_LOW), "{:04X}h:{sub:02X}", at(0x6095));
        }
        assert_eq!((bench.read(at(0x6095), 1), bench.read(at(0x6095), 2)), (1, 60), "nothing of it was stored");
        bench.set(&[(at(0x6060), 0, 3), (at(0x6040), 0, 6), (at(0x6040), 0, 7), (at(0x6040), 0, 15)]);
    }
    // The first axis has the factor of its encoder, TURN / 60: 6080h is what the motor turns at. The second has half of it.
    bench.set(&[(0x6095, 1, TURN), (0x6895, 1, TURN), (0x6895, 2, 120), (0x6080, 0, 600), (0x6880, 0, 600)]);
    bench.set(&[(0x60FF, 0, 20 * TURN), (0x68FF, 0, 20 * TURN)]);
    bench.run_ms(500);
    let rpm = |bench: &Bench, axis| bench.machine.report_of(AxisId(axis)).velocity_rpm;
    assert!((rpm(&bench, 0) - 600.0).abs() < 6.0, "{}", rpm(&bench, 0));
    assert!((rpm(&bench, 1) - 300.0).abs() < 3.0, "{}", rpm(&bench, 1));
    // It is stated in velocity units: with 6096h = 4 a unit is a quarter of the speed, and so is the limit.
    bench.set(&[(0x6096, 1, 4)]);
    bench.set(&[(0x60FF, 0, 80 * TURN)]);
    bench.run_ms(500);
    assert!((rpm(&bench, 0) - 150.0).abs() < 3.0, "{}", rpm(&bench, 0));
    assert!((rpm(&bench, 1) - 300.0).abs() < 3.0, "the other axis has its own");
}

#[test]
fn two_axes_at_two_sub_indexes_run_apart() {
    check(Bench::of(by_sub_index()));
}

#[test]
fn what_both_axes_need_stops_both() {
    let mut bench = Bench::of(by_offset());
    for index in [0x6040, 0x6840] {
        bench.set(&[(index, 0, 0x06), (index, 0, 0x07), (index, 0, 0x0F)]);
    }
    sim::VirtualDrive::hold_temperature(&mut bench.machine, sim::TemperatureSensor::Driver, Some(120.0), bench.now)
        .unwrap();
    bench.run_ms(100);
    for (status, error) in [(0x6041, 0x603F), (0x6841, 0x683F)] {
        assert_eq!((bench.read(status, 0) & 0x4F, bench.read(error, 0)), (0x08, 0x4210));
    }
    assert_eq!(bench.emcy(), [0x4210], "reported once");
}

/// A world with a two-axis servo as node 5.
fn world() -> World {
    let model = by_offset();
    let order = Order::new(model, NodeId::new(5).unwrap(), Bitrate::M1);
    let mut world = World::new(Bitrate::M1, 1);
    world.add_probe();
    world.add_drive(5, order_machine(model, &order).unwrap()).unwrap();
    world.run_for(Duration::from_millis(300));
    world
}

fn world_command(world: &mut World, line: &str) -> String {
    sim::command::answer(world, line).unwrap().json
}

fn report(world: &mut World, axis: u8) -> sim::Report {
    let look = |drive: &mut dyn VirtualDrive, now| {
        drive.advance(now);
        drive.report_of(AxisId(axis))
    };
    world.with_drive(5, look).unwrap()
}

#[test]
fn the_outer_world_reaches_each_axis_by_its_number() {
    let mut world = world();
    let channel = |axis| Channel { place: Place { node: 5, axis: AxisId(axis) }, signal: Signal::Velocity };
    world.start_recording(Recorder::new(Duration::from_millis(10), [channel(0), channel(1)]));
    // Nothing is enabled: the load alone turns the second shaft.
    assert!(world_command(&mut world, "5.2 load torque -0.3").starts_with("{\"ok\":true"));
    world.run_for(Duration::from_millis(200));
    let (first, second) = (report(&mut world, 0), report(&mut world, 1));
    assert!(first.velocity_rpm.abs() < 1e-6 && second.velocity_rpm > 100.0, "{first:?} {second:?}");
    assert!(second.position > first.position);
    assert!(world_command(&mut world, "5.2 get").contains(&format!("\"position\":{}", second.position)));
    world_command(&mut world, "5.2 rotor lock");
    world.run_for(Duration::from_millis(10));
    assert_eq!(report(&mut world, 1).velocity_rpm, 0.0);
    assert_eq!(
        world_command(&mut world, "5.3 get"),
        r#"{"ok":false,"error":{"kind":"refused","message":"a two-axes-by-offset has no axis 3; it has 2","node":null,"object":null,"abort":null,"next":"give what this drive has and takes; help lists the commands"}}"#
    );
    let recorder = world.stop_recording().unwrap();
    let names: Vec<String> = recorder.channels().iter().map(|channel| channel.place.to_string()).collect();
    assert_eq!(names, ["5", "5.2"]);
    assert!(recorder.samples(1).any(|rpm| rpm > 100.0) && recorder.samples(0).all(|rpm| rpm.abs() < 1e-6));
}

#[test]
fn the_objects_of_a_node_that_is_no_drive_are_the_outer_worlds() {
    const ROWS: &[Entry] = &[
        Entry::new(0x1000, 0, DataType::Unsigned32, Access::ReadOnly, "device_type", "").default(0x191),
        Entry::new(0x1001, 0, DataType::Unsigned8, Access::ReadOnly, "error_register", ""),
        Entry::new(0x6000, 1, DataType::Unsigned8, Access::ReadOnly, "read_input_8_bit", ""),
        Entry::new(0x6401, 1, DataType::Integer16, Access::ReadOnly, "read_analogue_input", ""),
    ];
    let model = leak(Description { name: "inputs", dictionary: table(ROWS.to_vec()), axes: &[], ..CIA402 });
    let order = Order::new(model, NodeId::new(9).unwrap(), Bitrate::M1);
    let mut world = World::new(Bitrate::M1, 1);
    let host = world.add_probe();
    world.add_drive(9, order_machine(model, &order).unwrap()).unwrap();
    world.run_for(Duration::from_millis(300));
    for line in ["9 set 6000:01 FFh", "9 set 6401:01 -2"] {
        assert!(world_command(&mut world, line).starts_with("{\"ok\":true"), "{line}");
    }
    while world.poll_received(host).is_some() {}
    for (request, answer) in [("40006001", "4F006001FF000000"), ("40016401", "4B016401FEFF0000")] {
        world.send(host, format!("609#{request}00000000").parse().unwrap()).unwrap();
        world.run_for(Duration::from_millis(20));
        let (_, frame) = world.poll_received(host).unwrap();
        assert_eq!(frame.to_string(), format!("589#{answer}"));
    }
    for (line, error) in [
        ("9 set 6000:01 256", "object 6000h:01 does not take it: UNSIGNED8 takes 0 to 255"),
        ("9 set 6001:00 1", "object 6001h:00 does not take it: the device has no such object"),
        ("9 set 6000:01 \\\"on\\\"", "object 6000h:01 does not take it: it is of type UNSIGNED8"),
        ("9 load torque 1", "a inputs has no motor"),
        ("9 input X0 1", "a inputs has no input \\\"X0\\\"; it has none"),
    ] {
        let answer = world_command(&mut world, &line.replace("\\\"", "\""));
        let start = format!("{{\"ok\":false,\"error\":{{\"kind\":\"refused\",\"message\":\"{error}\"");
        assert!(answer.starts_with(&start), "{line}: {answer}");
    }
}
