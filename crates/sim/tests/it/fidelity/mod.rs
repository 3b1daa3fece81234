//! Fidelity mechanical beside full, over the standard procedures and the faults that come from physics: docs/fidelity.md has the
//! table of what is measured here.

mod carried;
mod described;
mod hub_servo;
mod joint;
mod pair;
mod stepper;

use std::sync::LazyLock;

use can::Bitrate;
use canopen::NodeId;
use devices::Description;
use devices::servo::CIA402;
use pair::{NODE, Script, Subject, trace, world, write};
use sim::machine::{Order, order};
use sim::{Component, Fidelity, Place, Refused, Stimulus};

/// Controlwords up to operation enabled, from the fifth millisecond on.
fn enabled() -> Script {
    [0x06, 0x07, 0x0F].into_iter().zip(1..).map(|(word, n)| (n * 5, write(0x6040, 2, word))).collect()
}

/// Enabled in a mode with these values, and then more.
fn in_mode(mode: i64, values: &[(u16, usize, i64)], more: Script) -> Script {
    let values = [(0x6060, 1, mode)].into_iter().chain(values.iter().copied());
    let written = values.enumerate().map(|(ms, (index, size, value))| (ms as u64, write(index, size, value)));
    written.chain(enabled()).chain(more).collect()
}

#[test]
fn the_same_world_is_the_same_to_the_last_bit_and_so_is_its_snapshot() {
    repeats::<hub_servo::HubServo>(&hub_servo::velocity(100, Vec::new()));
    for rpm in [100, 2000] {
        repeats::<stepper::Short>(&stepper::velocity(rpm, Vec::new()));
    }
}

fn repeats<S: Subject>(script: &Script) {
    let run = || trace::<S>(Fidelity::Mechanical, script, 600);
    assert_eq!(run(), run());
    let (mut world, host) = world::<S>(Fidelity::Mechanical);
    for (_, act) in script {
        let pair::Act::Frame(frame) = act else { continue };
        world.send(host, *frame).expect("room at the host");
        world.run_for(std::time::Duration::from_millis(5));
    }
    let mut copy = world.clone();
    for world in [&mut world, &mut copy] {
        world.run_for(std::time::Duration::from_millis(700));
    }
    assert_eq!(world.digest(), copy.digest());
    assert_eq!(world.report(NODE), copy.report(NODE));
}

#[test]
fn a_node_without_a_motor_is_refused_when_it_is_ordered() {
    static NODE_ALONE: LazyLock<Description> = LazyLock::new(|| Description { name: "sensor", axes: &[], ..CIA402 });
    let node = NodeId::new(NODE).expect("a node-ID");
    let ordered = Order { fidelity: Fidelity::Mechanical, ..Order::new(&NODE_ALONE, node, Bitrate::K500) };
    let refusal = order(&NODE_ALONE, &ordered).err().expect("a refusal").to_string();
    assert!(refusal.contains("a sensor cannot be simulated with fidelity mechanical"), "{refusal}");
}

#[test]
fn every_model_of_a_drive_can_be_ordered_with_it() {
    for model in sim::machine::models() {
        let ordered = Order { fidelity: Fidelity::Mechanical, ..Order::new(model, NodeId::MIN, Bitrate::K500) };
        assert!(order(model, &ordered).is_ok(), "{}", model.name);
    }
}

#[test]
fn the_fidelity_of_a_drive_that_runs_stays() {
    let (mut world, _) = world::<hub_servo::HubServo>(Fidelity::Full);
    let asked = world.with_drive(NODE, |drive, now| drive.set_fidelity(Fidelity::Mechanical, now)).expect("a drive");
    assert!(matches!(asked, Err(Refused::Fidelity { .. })), "{asked:?}");
    let same = world.with_drive(NODE, |drive, now| drive.set_fidelity(Fidelity::Full, now)).expect("a drive");
    assert_eq!(same, Ok(()));
}

#[test]
fn a_fault_of_single_phases_is_refused_and_one_that_the_sensors_show_is_not() {
    fn asked<S: Subject>(component: Component) -> Result<(), Refused> {
        let (mut world, _) = world::<S>(Fidelity::Mechanical);
        world.apply(Place::node(NODE), &Stimulus::Fault(component, true)).expect("a drive")
    }
    for component in [Component::Phase, Component::Short] {
        for asked in [asked::<hub_servo::HubServo>, asked::<stepper::Short>] {
            let refused = asked(component).expect_err("a refusal");
            assert!(refused.to_string().contains("choose fidelity full for this fault"), "{refused}");
        }
    }
    for component in [Component::Hall, Component::Encoder, Component::Eeprom, Component::Reference] {
        assert_eq!(asked::<hub_servo::HubServo>(component), Ok(()), "{component:?}");
    }
}
