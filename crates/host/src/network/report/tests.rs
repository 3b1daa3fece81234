//! What was not seen is said to be not known.

use canopen::{AbortCode, Mux, NodeId};
use cia402::Statusword;
use devices::PowerStyle;
use master::Access;

use super::*;

fn state(power: PowerState, fault_code: Option<u16>) -> DriveState {
    DriveState {
        statusword: Statusword(0),
        power: Some(power),
        style: PowerStyle::Cia402,
        own_bits: &[],
        mode: None,
        fault_code,
        faults: Vec::new(),
        position: None,
        angle: None,
        velocity: None,
        current: None,
        supply: None,
        motor_temperature: None,
        driver_temperature: None,
        nmt: None,
        heartbeat_age: None,
    }
}

fn refused<T>(code: AbortCode) -> Result<T, Error> {
    let node = NodeId::new(4).expect("a node-ID");
    Err(Error::Aborted { node, mux: Mux::new(0x1003, 0), access: Access::Read, code })
}

/// A report of which only guard and faults are of interest.
fn report(guard: Guard, fault: (Option<PresentFault>, Option<String>)) -> NodeReport {
    let (remembered, remembered_not_known) = of_memory(refused(AbortCode::DEVICE_STATE)).expect("an answer");
    NodeReport {
        node: 4,
        model: "x",
        title: "X",
        manual: "manual",
        made: Made::default(),
        identity: Vec::new(),
        state: Vec::new(),
        compared: 0,
        not_compared: 0,
        differences: Vec::new(),
        refused: Vec::new(),
        pdos: Vec::new(),
        limits: Vec::new(),
        guard,
        fault: fault.0,
        fault_not_known: fault.1,
        remembered,
        remembered_not_known,
        captures: Vec::new(),
        tunings: Vec::new(),
    }
}

#[test]
fn no_fault_is_present_only_where_state_and_code_were_read() {
    let of = |power, code| present_fault(Some(&state(power, code)), None);
    let (fault, why) = of(PowerState::SwitchedOn, Some(0));
    assert!(fault.is_none() && why.is_none());
    let (fault, why) = of(PowerState::SwitchedOn, None);
    assert!(fault.is_none() && why.is_some());
    for code in [Some(0), None] {
        let (fault, why) = of(PowerState::Fault, code);
        assert!(fault.is_some_and(|fault| fault.code.is_none()) && why.is_none(), "{code:?}");
    }
    let (fault, _) = of(PowerState::SwitchedOn, Some(0x2310));
    assert_eq!(fault.map(|fault| fault.text()).as_deref(), Some("2310h"));
    let (fault, why) = present_fault(None, Some("refused".into()));
    assert!(fault.is_none() && why.is_some());
}

#[test]
fn only_an_object_that_does_not_exist_is_a_memory_that_is_known_to_be_none() {
    assert_eq!(of_memory(refused(AbortCode::NO_SUCH_OBJECT)).expect("an answer"), (None, None));
    let (remembered, why) = of_memory(refused(AbortCode::HARDWARE_ERROR)).expect("an answer");
    assert!(remembered.is_none() && why.is_some_and(|why| why.contains("hardware error")));
}

#[test]
fn a_page_says_what_is_not_known_and_not_what_would_be_worse_or_better() {
    let page = report(guard(None), present_fault(Some(&state(PowerState::SwitchedOn, None)), None)).to_html();
    for part in [
        "<div class=\"na\"><b>Not known</b>",
        "Not known: the device refuses to show the object that sets its watch.",
        "Not known whether a fault is present: the drive refuses to show its fault code.",
        "Not known which errors it remembers: ",
        "faults seen; others are not known",
    ] {
        assert!(page.contains(part), "{part}: {page}");
    }
    for part in ["Goes on", "No fault is present", "no object 1003h", "dies, the device"] {
        assert!(!page.contains(part), "{part}: {page}");
    }
    let known = report(guard(Some(HostLoss::GoesOn)), present_fault(Some(&state(PowerState::Fault, Some(0))), None));
    let page = known.to_html();
    assert!(page.contains("<b>Goes on</b>") && page.contains("Present: the state is a fault"), "{page}");
}
