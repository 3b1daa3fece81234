use can::{Bitrate, Instant, Station};
use canopen::{NmtState, NodeId};
use cia402::{ModeOfOperation, PowerState};
use devices::AxisId;

use crate::Fidelity;

/// The firmware of a drive: a station on the bus that also owns a power stage.
///
/// # Contract
/// - [`power_on`](Self::power_on) starts it from cold; until then, and after [`power_off`](Self::power_off), it is
///   silent and its power stage is off.
/// - The owner calls [`tick`](Self::tick) once every [`CONTROL_PERIOD_NS`](Self::CONTROL_PERIOD_NS), as a
///   microcontroller's timer interrupt does, with what the sensors read at that moment. What it returns holds from
///   the next tick to the one after it: duty cycles go through the timer's shadow registers.
/// - [`Station::poll_timeout`] covers communication only and never asks for a tick.
/// - The owner keeps [`eeprom`](Self::eeprom) over power cycles: whenever the generation has changed, the bytes have.
///   A write that was cut short in the middle leaves the old contents or the new ones.
pub trait Firmware: Station + Clone {
    /// What the drive can measure.
    type Sensors: Clone + PartialEq;
    /// What the drive does to the outer world.
    type Actuation: Clone + PartialEq;
    /// What the drive finds when it wakes: switches and memory.
    type Hardware;

    /// Time between two ticks, in nanoseconds.
    const CONTROL_PERIOD_NS: u64;

    /// Of a firmware whose power stage follows by itself: control periods up to its first tick, which is the first supervision, and
    /// from one tick to the next. None if it has no such form.
    const MECHANICAL_PERIODS: Option<[u32; 2]> = None;

    /// From its next start on it is of this fidelity; [`Fidelity::Mechanical`] of those only that have
    /// [`MECHANICAL_PERIODS`](Self::MECHANICAL_PERIODS). Its ticks are as long then, and what one returns holds from that tick on.
    fn set_fidelity(&mut self, fidelity: Fidelity) {
        let _ = fidelity;
    }

    /// Supply voltage arrives: starts from `hardware` and sends the boot-up message.
    fn power_on(&mut self, hardware: &Self::Hardware, now: Instant);

    /// Supply voltage is gone: everything that is not in the EEPROM is forgotten.
    fn power_off(&mut self, now: Instant);

    /// One control period.
    fn tick(&mut self, sensors: &Self::Sensors, now: Instant) -> Self::Actuation;

    /// Contents of the EEPROM, and a number that changes with them.
    fn eeprom(&self) -> (&[u8], u32);

    /// A value that was written, and perhaps acknowledged, is not in the EEPROM yet and will be with the next run of the
    /// communication task, which changes the generation by one.
    fn is_storing(&self) -> bool;

    /// How an axis of the drive is, for people; of one that a drive of several does not have, nothing that moves.
    fn report(&self, axis: AxisId) -> Report;
}

/// How an axis of a drive is, in its own terms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// Supplied and running.
    pub powered: bool,
    /// Node-ID in use.
    pub node_id: NodeId,
    /// Bit rate in use.
    pub bitrate: Bitrate,
    /// NMT state.
    pub nmt: NmtState,
    /// State of the power drive state machine.
    pub state: PowerState,
    /// Mode in effect (6061h).
    pub mode: ModeOfOperation,
    /// Value of the drive's fault code object; 0 for none.
    pub fault_code: u16,
    /// Position in the drive's own counts, as 6064h gives it.
    pub position_counts: i32,
    /// Velocity of the motor's shaft in r/min.
    pub velocity_rpm: f32,
    /// Signed motor current in A.
    pub current_a: f32,
    /// The brake output holds.
    pub brake_engaged: bool,
}
