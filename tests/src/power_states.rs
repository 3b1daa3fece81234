//! The CiA 402 power states of a running drive: the ways into them, and the table of states and events asked over the bus.
//!
//! Two states cannot be seen from the bus. Not ready to switch on ends before the boot-up message goes out. Fault
//! reaction active takes no time: no manual names a fault reaction ramp, so the power stage goes off at once and
//! transition 14 follows 13 in the same control period.

use sim::Component;

use crate::bench::{Bench, BenchSubject};
use crate::manual::PowerCell;

const UNSEEN: [&str; 2] = ["not_ready_to_switch_on", "fault_reaction_active"];

/// A drive with the power state machine of CiA 402.
pub trait PowerSubject: BenchSubject {
    /// A component whose break is a fault in every state, and which can be mended.
    const BREAKABLE: Component;

    /// The code of that fault (603Fh), and the error register with it (1001h).
    const BROKEN: (u16, u8);

    /// Its `power_state.csv`; with each cell the bits of the statusword above the low byte, of those in [`ABOVE`](Self::ABOVE).
    fn power_states() -> Vec<(PowerCell, u16)>;

    /// Bits above the low byte in the cells.
    const ABOVE: u16;

    /// Its `statusword_at_rest.csv`.
    const STATUSWORD_AT_REST: &'static str;

    /// The statusword of a drive that has just booted.
    const BOOTED: u16;

    /// The low byte of the statusword in the state Fault, with the bus voltage present. CiA 402-2 has 18h; bit 7 is a warning.
    const FAULT: u16 = 0x98;

    /// The bit of the statusword that reports that the motor turns; none where the manufacturer has not added one.
    const RUNNING: u16 = 1 << 14;

    /// Modes in which it moves, but for torque.
    const MOVING_MODES: &'static [i64];

    /// How far 6064h may be from a target that is reached.
    const IN_POSITION: i64;

    /// The time of an emergency stop (605Ah = 7, 605Dh = 3) from 120 r/min with 6085h = 50 ms: that of the command.
    const EMERGENCY_STOP_S: f64;

    /// The ramp of homing, as [`let_home`](Self::let_home) sets it.
    const HOMING_RAMP_S: f64;

    /// How long after its command the motor stands.
    const STANDS_AFTER_MS: u64;

    /// A torque that turns a free shaft and not one that is held, N m.
    const HAND_NM: f64;

    /// 6064h counts so many in 1/4096 of a turn, in which the scenarios measure moves.
    const COUNTS: i64 = 1;

    /// 606Ch counts so many in 1 r/min.
    const COUNTS_PER_RPM: i64;

    /// How far the speed of a motor that turns steadily may be from what is asked for, r/min.
    const RIPPLE_RPM: f64;

    /// Sets a ramp object so that 120 r/min take this time. Here: it is the time.
    fn set_ramp(bench: &mut Bench<Self>, object: u16, ms: i64)
    where
        Self: Sized,
    {
        bench.set(object, ms);
    }

    /// What homing needs besides its mode, so that it searches at 120 r/min.
    fn let_home(_bench: &mut Bench<Self>)
    where
        Self: Sized,
    {
    }

    /// What has to be set so that a test may take its time between two commands.
    fn let_take_time(_bench: &mut Bench<Self>)
    where
        Self: Sized,
    {
    }
}

/// What only the two ZLTECH drives have, and alike.
pub trait ZltechSubject: PowerSubject {
    /// Objects that clear the position.
    const CLEARS_POSITION: &'static [u16];

    /// The object with the speed that a motion from rest begins with, r/min.
    const START_SPEED: u16;

    /// How many digital inputs it has.
    const INPUTS: usize;

    /// Sub-indexes of 2030h that hold the functions of Y0 and Y1.
    const OUTPUT_FUNCTIONS: [u8; 2];
}

impl<S: PowerSubject> Bench<S> {
    /// A drive without a mode, standing, in a state.
    #[must_use]
    pub fn in_state(state: &str) -> Self {
        let mut bench = Self::new();
        bench.reach(state);
        bench
    }

    /// From switch on disabled to a state.
    pub fn reach(&mut self, state: &str) {
        let controlwords: &[i64] = match state {
            "switch_on_disabled" | "fault" => &[],
            "ready_to_switch_on" => &[0x06],
            "switched_on" => &[0x06, 0x07],
            "operation_enabled" => &[0x06, 0x07, 0x0F],
            "quick_stop_active" => &[0x06, 0x07, 0x0F, 0x02],
            other => panic!("no way to {other}"),
        };
        S::let_take_time(self);
        for controlword in controlwords {
            self.set(0x6040, *controlword);
        }
        if state == "fault" {
            self.break_down(true).break_down(false);
        }
    }

    /// The power stage drives the motor: it carries current, or holds its shaft against a hand.
    pub fn is_energised(&mut self) -> bool {
        let before = self.set_load_torque(S::HAND_NM).run_ms(200).report().shaft_angle_rad;
        let after = self.run_ms(200).report().shaft_angle_rad;
        self.set_load_torque(0.0).run_ms(200);
        (after - before).abs() < 0.01
    }

    /// Selects a mode and enables operation.
    #[track_caller]
    pub fn enable_in(&mut self, mode: i64) -> &mut Self {
        S::let_take_time(self);
        self.set(0x6060, mode).enable()
    }

    /// Turning with this speed in profile velocity, and steadily.
    #[track_caller]
    pub fn turn(&mut self, rpm: i64) -> &mut Self {
        self.enable_in(3).set(0x60FF, rpm).run_ms(800)
    }

    /// Asserts that the motor turns steadily at this speed, and that 606Ch reports it.
    #[track_caller]
    pub fn goes_at(&mut self, rpm: i64) -> &mut Self {
        let (reported, asked) = (self.get(0x606C), rpm * S::COUNTS_PER_RPM);
        assert!(
            (reported - asked).abs() <= S::COUNTS_PER_RPM,
            "606Ch is {reported} for {rpm} r/min, at {} s",
            self.seconds()
        );
        self.turns_at(rpm as f64 - S::RIPPLE_RPM, rpm as f64 + S::RIPPLE_RPM)
    }

    /// Relative move of profile position, by so many 4096ths of a turn.
    #[track_caller]
    pub fn move_by(&mut self, counts: i64) -> &mut Self {
        self.set(0x607A, counts * S::COUNTS).set(0x6040, 0x4F).set(0x6040, 0x5F)
    }

    /// Breaks the component whose break is a fault, or mends it, and lets the drive notice.
    pub fn break_down(&mut self, broken: bool) -> &mut Self {
        self.set_fault(S::BREAKABLE, broken).run_ms(50)
    }

    fn cause(&mut self, cell: &PowerCell) {
        match (cell.controlword, &*cell.event) {
            (Some(controlword), _) => self.set(0x6040, 0x00FF & i64::from(controlword)).run_ms(10),
            (None, "fault_occurs") => self.break_down(true),
            // Ends of what the drive does by itself: there is nothing of the kind under way, time passes.
            (None, _) => self.run_ms(1000),
        };
    }
}

/// Asserts that every event in every state that can be seen leads where the table says. With each cell come the bits
/// above the low byte that the statusword then has among those of `mask`.
pub fn lead_where_the_table_says<S: PowerSubject>(cells: &[(PowerCell, u16)], mask: u16) {
    let seen: Vec<_> = cells.iter().filter(|(cell, _)| !UNSEEN.contains(&&*cell.state)).collect();
    assert_eq!(seen.len(), 66);
    let differences: Vec<_> = seen.iter().filter_map(|(cell, above)| difference::<S>(cell, *above, mask)).collect();
    assert!(differences.is_empty(), "{}", differences.join("\n"));
}

fn difference<S: PowerSubject>(cell: &PowerCell, above: u16, mask: u16) -> Option<String> {
    let mut bench = Bench::<S>::in_state(&cell.state);
    bench.cause(cell);
    let statusword = bench.statusword() & (mask | 0xFF);
    let low_byte = match &*cell.state_after {
        // Seen one transition later: Fault.
        "fault_reaction_active" => S::FAULT,
        _ => u16::from(cell.low_byte_after),
    };
    let expected = low_byte | above;
    (statusword != expected)
        .then(|| format!("{} on {}: {statusword:04X}h, expected {expected:04X}h", cell.state, cell.event))
}
