//! The alarms as one table: 260Eh ("M Robot Joint Motor CanOpen Manual", "Status indication and alarm").
//!
//! 12h and 14h are both stalls by name; the family's older register list calls 12h over-current and 14h block. So 12h
//! is a current that stays at its limit (261Dh), 14h an output that does (2618h). There is no EMCY.

use canopen::EmcyErrorCode;

use crate::faults::FaultRow;

/// Rows of [`ALARMS`], the most important first: 260Eh has room for one.
pub mod row {
    /// 15h.
    pub const OVER_VOLTAGE: usize = 0;
    /// 12h.
    pub const LOCKED_ROTOR: usize = 1;
    /// 14h.
    pub const STALL: usize = 2;
    /// 20h.
    pub const COMMUNICATION: usize = 3;
    /// 10h.
    pub const BATTERY: usize = 4;
}

/// Number of alarms.
pub const ALARM_COUNT: usize = 5;

/// All alarms.
#[rustfmt::skip]
pub static ALARMS: [FaultRow; ALARM_COUNT] = [
    alarm(0x15, "over-voltage",
        "Over 52 V. Lower the supply; if the motor generates it while braking, fit a discharge module. Then reset."),
    alarm(0x12, "locked rotor",
        "The current stayed at the limit of 261Dh for its seconds: free the output or raise 261Dh, then reset."),
    alarm(0x14, "stall",
        "The output stayed at the limit of 2618h for its seconds without motion: free the output, then reset."),
    alarm(0x20, "communication lost",
        "No heartbeat of the node in 1016h within its time. Send it again: the alarm clears itself and the motor goes on."),
    alarm(0x10, "battery lost",
        "The encoder's turns are unknown. Check the battery, then set the origin: 60006 and 60016 to 260Ah."),
];

/// EMCY codes are not used: the drive sends none.
const fn alarm(code: u16, name: &'static str, remedy: &'static str) -> FaultRow {
    FaultRow { code, name, remedy, error_register: 0, emcy: EmcyErrorCode::NO_ERROR, hides_motion: false }
}
