//! The meanings of states, bits and modes that a page shows, in a sentence or two, with the clause of the standard.
//!
//! Terms of a model (objects, faults, its own bits) are in its description; all others are in this one table.

/// A term of the page, and its meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Word {
    /// As the page shows it.
    pub(crate) name: &'static str,
    /// In words.
    pub(crate) text: &'static str,
    /// Document and clause.
    pub(crate) source: &'static str,
}

/// Power states, by their names in the standard.
pub(crate) const STATES: [Word; 8] = [
    state(
        "Not ready to switch on",
        "The drive starts and tests itself. It leaves this state by itself and ignores commands until then.",
    ),
    state(
        "Switch on disabled",
        "The drive is ready for its first command. The motor has no power. Enable to continue.",
    ),
    state("Ready to switch on", "The motor has no power; the supply of the power stage may be switched on."),
    state("Switched on", "The power stage has its supply, and the motor has no torque yet."),
    state("Operation enabled", "The motor has power and follows its set-points."),
    state(
        "Quick stop active",
        "The drive stops, or has stopped, with its quick stop ramp (6085h). 605Ah sets whether it keeps its power then. Enable or disable it to continue.",
    ),
    state(
        "Fault reaction active",
        "A fault has occurred and the drive is stopping because of it. It changes to Fault by itself.",
    ),
    state(
        "Fault",
        "The drive has stopped because of a fault, and the motor has no power. Remove the cause, then reset the fault.",
    ),
];

/// Services of the frames in the trace, and events of a node other than its states.
pub(crate) const SERVICES: [Word; 14] = [
    service(
        "nmt",
        "A command of the NMT master: start, stop, pre-operational, reset. Node 0 means all nodes.",
        "CiA 301, 7.2.8",
    ),
    service("sync", "The common clock with which synchronous PDOs are sent and take effect.", "CiA 301, 7.2.5"),
    service("time", "The time of day, for nodes that consume it (1012h).", "CiA 301, 7.2.6"),
    service("emcy", "An emergency message: a node reports an error, or with code 0000h its end.", "CiA 301, 7.2.7"),
    service(
        "pdo",
        "Process data: up to 8 bytes without confirmation, split by the mapping in the node. TPDOs come from a node, RPDOs go to it.",
        "CiA 301, 7.2.2",
    ),
    service(
        "sdo",
        "Reads or writes an object of one node; each request is answered, or aborted with a code.",
        "CiA 301, 7.2.4",
    ),
    service(
        "heartbeat",
        "A node sends its NMT state periodically; the first message after its start is the boot-up message.",
        "CiA 301, 7.2.8.3.2",
    ),
    service("lss", "Finds nodes by their LSS address, and sets node-ID and bit rate.", "CiA 305"),
    service(
        "other",
        "No service of the predefined connection set has this identifier; a PDO may have been moved to it.",
        "CiA 301, 7.3.5",
    ),
    service(
        "booted",
        "The node has started and sent its boot-up message. Values that were not stored are lost.",
        "CiA 301, 7.2.8.3.3",
    ),
    service("silent", "The node is silent: its heartbeat is overdue, or it does not answer.", "CiA 301, 7.2.8.3.2"),
    service("stop", "This studio stopped the drive, by a quick stop.", "CiA 402-2, 8.2"),
    service(
        "fault",
        "The drive reports a fault in its fault object. The entry has its name, possible causes and remedies.",
        "CiA 402-2, 8.2",
    ),
    service("alarm", "The heartbeat of this model reports an alarm: read its fault object for the code.", "its manual"),
];

const fn service(name: &'static str, text: &'static str, source: &'static str) -> Word {
    Word { name, text, source }
}

/// Bits of the statusword in the standard, and the meaning of bit 12 in each mode.
pub(crate) const STATUS_BITS: [Word; 18] = [
    status("ready to switch on", "Bit 0. With bits 1, 2, 3, 5 and 6 it gives the power state."),
    status("switched on", "Bit 1. With bits 0, 2, 3, 5 and 6 it gives the power state."),
    status("operation enabled", "Bit 2: the motor has power and follows its set-points."),
    status("fault", "Bit 3: the drive has stopped because of a fault, or is stopping."),
    status("voltage enabled", "Bit 4: the power stage has its supply."),
    status("quick stop active", "Bit 5 is 0: a quick stop is active, or has brought the motor to rest."),
    status(
        "switch on disabled",
        "Bit 6: the drive has to be commanded to Ready to switch on before it can be enabled.",
    ),
    status("warning", "Bit 7: a value is near its limit. The drive keeps running."),
    status("bit 8", "Bit 8 is manufacturer-specific, and not in the description of this model."),
    status(
        "remote",
        "Bit 9: the drive follows the controlword of the bus. Without it the drive is under local control.",
    ),
    status("target reached", "Bit 10: the set-point is reached, or the motor is at rest after a halt or a quick stop."),
    status("internal limit active", "Bit 11: a limit of the drive restricts the set-point."),
    status(
        "set-point acknowledged",
        "Bit 12 in profile position: the drive has accepted the set-point. It is cleared when bit 4 of the controlword is cleared.",
    ),
    status("speed is zero", "Bit 12 in profile velocity: the motor is at rest, by the velocity threshold (606Fh)."),
    status(
        "bit 12",
        "Bit 12 depends on the mode of operation; in this one the standard leaves it reserved or manufacturer-specific.",
    ),
    status(
        "bit 13",
        "Bit 13 is an error of the mode: following error in the position modes, homing error in homing, slippage in profile velocity.",
    ),
    status("bit 14", "Bit 14 is manufacturer-specific, and not in the description of this model."),
    status("bit 15", "Bit 15 is manufacturer-specific, and not in the description of this model."),
];

/// Bits 12 and 13 in homing.
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

/// Bits of the controlword with the same meaning in all modes.
pub(crate) const CONTROL_BITS: [Word; 6] = [
    control("switch on", "Bit 0. Bits 0 to 3 together are the command to the power state machine."),
    control("enable voltage", "Bit 1: the power stage may have its supply. 0 removes the power of the motor at once."),
    control("no quick stop", "Bit 2. 0 commands a quick stop."),
    control("enable operation", "Bit 3: the motor shall have power and follow its set-points."),
    control("fault reset", "Bit 7: its change from 0 to 1 resets a fault whose cause is gone."),
    control("halt", "Bit 8: the motor shall come to rest with its ramp, as set in 605Dh."),
];

/// NMT states.
pub(crate) const NMT: [Word; 4] = [
    nmt("initialising", "The node starts, and reports it with its boot-up message."),
    nmt("pre-operational", "The node answers SDO; its PDOs are inactive."),
    nmt("operational", "The node answers SDO, and its PDOs are active."),
    nmt("stopped", "The node follows NMT commands and sends its heartbeat; nothing else."),
];

/// Modes of operation, by their names in the standard.
pub(crate) const MODES: [Word; 10] = [
    mode("no mode", "No mode is selected: nothing moves until one is (6060h).", "CiA 402-2, table 46"),
    mode(
        "profile position",
        "The drive plans the path to a target position (607Ah) with its own speed and ramps.",
        "CiA 402-2, clause 10",
    ),
    mode("velocity", "The velocity mode of frequency converters.", "CiA 402-2, velocity mode"),
    mode(
        "profile velocity",
        "The drive brings the motor to a target velocity (60FFh) with its own ramps.",
        "CiA 402-2, profile velocity mode",
    ),
    mode(
        "profile torque",
        "The drive brings the torque to its target (6071h) with its slope; the speed depends on the load.",
        "CiA 402-2, profile torque mode",
    ),
    mode("homing", "The drive searches for its home position with a method (6098h).", "CiA 402-2, clause 11"),
    mode(
        "interpolated position",
        "The host sends positions periodically, and the drive interpolates between them.",
        "CiA 402-2, clause 12",
    ),
    mode(
        "cyclic synchronous position",
        "The host sends a position in each cycle and plans the path.",
        "CiA 402-2, cyclic synchronous position mode",
    ),
    mode(
        "cyclic synchronous velocity",
        "The host sends a velocity in each cycle and plans the path.",
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
