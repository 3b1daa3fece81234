//! What the words mean that a page shows: states, bits, modes, in a sentence or two, with the clause of the standard.
//!
//! What belongs to a model (objects, faults, bits of its own) is in its description; the rest is this one table.

/// A word of the page, and what it means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Word {
    /// As the page shows it.
    pub(crate) name: &'static str,
    /// In words.
    pub(crate) text: &'static str,
    /// Document and clause.
    pub(crate) source: &'static str,
}

/// Power states, by the standard's names.
pub(crate) const STATES: [Word; 8] = [
    state(
        "Not ready to switch on",
        "The drive starts and tests itself. It goes on by itself; commands are not followed yet.",
    ),
    state(
        "Switch on disabled",
        "The drive is ready for its first command. The motor has no power. Enable takes it from here.",
    ),
    state("Ready to switch on", "The motor has no power; the supply of the power stage may be switched on."),
    state("Switched on", "The power stage has its supply, and the motor has no torque yet."),
    state("Operation enabled", "The motor has power and follows its set-points."),
    state(
        "Quick stop active",
        "The drive stops, or has stopped, by its quick stop ramp (6085h). 605Ah says whether it keeps its power then. Enable or disable it to go on.",
    ),
    state(
        "Fault reaction active",
        "A fault has come up and the drive is stopping because of it. It goes on to Fault by itself.",
    ),
    state(
        "Fault",
        "The drive has stopped because of a fault, and the motor has no power. Remove the cause, then reset the fault.",
    ),
];

/// What a frame of the trace belongs to, and what happens to a node beside its states.
pub(crate) const SERVICES: [Word; 14] = [
    service(
        "nmt",
        "A command of the NMT master: start, stop, pre-operational, reset. Node 0 is all nodes.",
        "CiA 301, 7.2.8",
    ),
    service("sync", "The beat by which synchronous PDOs are sent and taken over.", "CiA 301, 7.2.5"),
    service("time", "The time of day, for nodes that consume it (1012h).", "CiA 301, 7.2.6"),
    service(
        "emcy",
        "An emergency message: a node tells that an error has come up, or with code 0000h that it is over.",
        "CiA 301, 7.2.7",
    ),
    service(
        "pdo",
        "Process data: up to 8 bytes without any question or answer, split by the mapping in the node. TPDOs come from a node, RPDOs go to it.",
        "CiA 301, 7.2.2",
    ),
    service(
        "sdo",
        "An object of one node is read or written; each request is answered, or aborted with a code.",
        "CiA 301, 7.2.4",
    ),
    service(
        "heartbeat",
        "A node says its NMT state from time to time; the first one after its start is the boot-up message.",
        "CiA 301, 7.2.8.3.2",
    ),
    service("lss", "Nodes are found by their LSS address, and get node-ID and bit rate.", "CiA 305"),
    service(
        "other",
        "No service of the predefined connection set has this identifier; a PDO may have been moved there.",
        "CiA 301, 7.3.5",
    ),
    service(
        "booted",
        "The node has started and sent its boot-up message. What it had not stored is as it was before.",
        "CiA 301, 7.2.8.3.3",
    ),
    service(
        "silent",
        "Nothing is heard of the node: its heartbeat stays away longer than it may, or it answers nothing.",
        "CiA 301, 7.2.8.3.2",
    ),
    service("stop", "This studio stopped the drive, by a quick stop.", "CiA 402-2, 8.2"),
    service(
        "fault",
        "The drive tells a fault in its fault object. The line says which, what may cause it and what to do.",
        "CiA 402-2, 8.2",
    ),
    service("alarm", "The heartbeat of this model tells an alarm: read its fault object for which.", "its manual"),
];

const fn service(name: &'static str, text: &'static str, source: &'static str) -> Word {
    Word { name, text, source }
}

/// Bits of the statusword that the standard fixes, and what bits 12 mean in the modes.
pub(crate) const STATUS_BITS: [Word; 18] = [
    status("ready to switch on", "Bit 0. With bits 1, 2, 3, 5 and 6 it tells the power state."),
    status("switched on", "Bit 1. With bits 0, 2, 3, 5 and 6 it tells the power state."),
    status("operation enabled", "Bit 2: the motor has power and follows its set-points."),
    status("fault", "Bit 3: the drive has stopped because of a fault, or is stopping."),
    status("voltage enabled", "Bit 4: the power stage has its supply."),
    status("quick stop active", "Bit 5 is 0: a quick stop acts, or has brought the motor to rest."),
    status(
        "switch on disabled",
        "Bit 6: the drive has to be commanded to Ready to switch on before it can be enabled.",
    ),
    status("warning", "Bit 7: something is near its limit. The drive goes on."),
    status("bit 8", "Bit 8 is the maker's, and this model's description does not say what it means."),
    status(
        "remote",
        "Bit 9: the controlword of the bus is followed. Without it somebody commands the drive on the spot.",
    ),
    status("target reached", "Bit 10: the set-point is reached, or after a halt or a quick stop the motor stands."),
    status("internal limit active", "Bit 11: a limit of the drive holds the set-point back."),
    status(
        "set-point acknowledged",
        "Bit 12 in profile position: the drive has taken the set-point. It falls when bit 4 of the controlword falls.",
    ),
    status("speed is zero", "Bit 12 in profile velocity: the motor stands, by the velocity threshold (606Fh)."),
    status(
        "bit 12",
        "Bit 12 means what the mode of operation says, and in this one the standard leaves it open or gives it to the maker.",
    ),
    status(
        "bit 13",
        "Bit 13 is an error of the mode: following error in the position modes, homing error in homing, slippage in profile velocity.",
    ),
    status("bit 14", "Bit 14 is the maker's, and this model's description does not say what it means."),
    status("bit 15", "Bit 15 is the maker's, and this model's description does not say what it means."),
];

/// What bit 12 tells of homing.
pub(crate) const HOMING_BITS: [Word; 2] = [
    Word {
        name: "homing attained",
        text: "The last homing run found the home position.",
        source: "CiA 402-2, clause 11",
    },
    Word {
        name: "homing error",
        text: "The last homing run ended without a home position.",
        source: "CiA 402-2, clause 11",
    },
];

/// Bits of the controlword that mean the same in all modes.
pub(crate) const CONTROL_BITS: [Word; 6] = [
    control("switch on", "Bit 0. Bits 0 to 3 together are the command to the power state machine."),
    control("enable voltage", "Bit 1: the power stage may have its supply. 0 takes the power off the motor at once."),
    control("no quick stop", "Bit 2. 0 asks for a quick stop."),
    control("enable operation", "Bit 3: the motor is to have power and follow its set-points."),
    control("fault reset", "Bit 7: its change from 0 to 1 resets a fault whose cause is gone."),
    control("halt", "Bit 8: the motor is to come to rest by its ramp, as 605Dh says."),
];

/// NMT states.
pub(crate) const NMT: [Word; 4] = [
    nmt("initialising", "The node starts. It says so with its boot-up message."),
    nmt("pre-operational", "The node answers SDO; its PDOs rest."),
    nmt("operational", "The node answers SDO, and its PDOs go."),
    nmt("stopped", "The node hears NMT commands and tells its heartbeat; nothing else."),
];

/// Modes of operation, by the standard's names.
pub(crate) const MODES: [Word; 10] = [
    mode("no mode", "No mode is chosen: nothing moves before one is (6060h).", "CiA 402-2, table 46"),
    mode(
        "profile position",
        "The drive plans the way to a target position (607Ah) by its own speed and ramps.",
        "CiA 402-2, clause 10",
    ),
    mode("velocity", "The velocity mode of frequency converters.", "CiA 402-2, velocity mode"),
    mode(
        "profile velocity",
        "The drive brings the motor to a target velocity (60FFh) by its own ramps.",
        "CiA 402-2, profile velocity mode",
    ),
    mode(
        "profile torque",
        "The drive brings the torque to its target (6071h) by its slope; the speed is up to the load.",
        "CiA 402-2, profile torque mode",
    ),
    mode("homing", "The drive looks for its home position by a method (6098h).", "CiA 402-2, clause 11"),
    mode(
        "interpolated position",
        "The host sends positions in time, and the drive goes evenly from one to the next.",
        "CiA 402-2, clause 12",
    ),
    mode(
        "cyclic synchronous position",
        "The host sends a position in each cycle and plans the way.",
        "CiA 402-2, cyclic synchronous position mode",
    ),
    mode(
        "cyclic synchronous velocity",
        "The host sends a velocity in each cycle and plans the way.",
        "CiA 402-2, cyclic synchronous velocity mode",
    ),
    mode(
        "cyclic synchronous torque",
        "The host sends a torque in each cycle and closes the loops around it.",
        "CiA 402-2, cyclic synchronous torque mode",
    ),
];

const fn state(name: &'static str, text: &'static str) -> Word {
    Word { name, text, source: "CiA 402-2, 8.2" }
}

const fn status(name: &'static str, text: &'static str) -> Word {
    Word { name, text, source: "CiA 402-2, 8.4.2" }
}

const fn control(name: &'static str, text: &'static str) -> Word {
    Word { name, text, source: "CiA 402-2, 8.4.1" }
}

const fn nmt(name: &'static str, text: &'static str) -> Word {
    Word { name, text, source: "CiA 301, 7.3.2.2" }
}

const fn mode(name: &'static str, text: &'static str, source: &'static str) -> Word {
    Word { name, text, source }
}
