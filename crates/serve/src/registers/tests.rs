//! A joint by its registers, with the addresses and scales of the "M Robot Joint Motor CanOpen Manual", 5.04.

use std::time::Duration;

use machine::file::Machine;
use sim::{Place, Report};

use super::*;

const JOINT: u8 = 2;

const MODBUS_ENABLE: u16 = 0x00;
const PROFILE_VELOCITY: u16 = 0x02;
const CURRENT: u16 = 0x11;
const SPEED: u16 = 0x12;
const VOLTAGE: u16 = 0x13;
const POSITION: u16 = 0x18;
const TARGET_POSITION: u16 = 0x1C;
const TARGET_VELOCITY: u16 = 0x1E;
const CONTROLWORD: u16 = 0x23;
const STATUSWORD: u16 = 0x24;
const MODE: u16 = 0x25;

/// A joint, and beside it a drive that has no RS485 here.
struct Bench(World);

impl Bench {
    fn new() -> Self {
        let drives =
            "timing = 'ideal'\n[[drive]]\nmodel = 'm4230e17b50'\nnode = 2\n[[drive]]\nmodel = 'zlac8030l'\nnode = 4\n";
        let mut world = Machine::parse(drives).expect("a machine file").build().expect("a machine");
        world.run_for(Duration::from_secs(1));
        Self(world)
    }

    fn asked(&mut self, unit: u8, access: RegisterAccess) -> RegisterAnswer {
        of_unit(&mut self.0, unit, &Ok(access)).0
    }

    fn written(&mut self, address: u16, words: &[u16]) -> RegisterAnswer {
        self.asked(JOINT, RegisterAccess::Write { address, words: words.to_vec() })
    }

    #[track_caller]
    fn write(&mut self, address: u16, words: &[u16]) {
        assert_eq!(self.written(address, words), Some(Ok(Vec::new())), "{address:02X}h");
    }

    #[track_caller]
    fn words<const N: usize>(&mut self, address: u16) -> [u16; N] {
        let words = self.asked(JOINT, RegisterAccess::Read { address, count: N as u16 });
        words.expect("the unit").expect("an answer").try_into().expect("as many as asked for")
    }

    #[track_caller]
    fn word(&mut self, address: u16) -> u16 {
        self.words::<1>(address)[0]
    }

    /// The low word comes first.
    fn position(&mut self) -> i32 {
        let [low, high] = self.words(POSITION);
        (u32::from(high) << 16 | u32::from(low)) as i32
    }

    fn apply(&mut self, stimulus: &str) {
        let stimulus = stimulus.parse().expect("a stimulus");
        self.0.apply(Place::node(JOINT), &stimulus).expect("the joint").expect("it takes it");
    }

    /// What is true of the joint, whatever it says.
    fn truth(&mut self) -> Report {
        self.0.report(JOINT).expect("the joint")
    }

    /// Lets time pass until something is so.
    #[track_caller]
    fn until(&mut self, what: &str, is_so: impl Fn(&mut Self) -> bool) {
        for _ in 0..1000 {
            if is_so(self) {
                return;
            }
            self.0.run_for(Duration::from_millis(20));
        }
        panic!("{what} does not come in 20 s");
    }
}

#[test]
fn a_joint_moves_and_says_its_values_in_the_scales_of_the_manual() {
    let mut joint = Bench::new();
    joint.write(MODBUS_ENABLE, &[1]);

    // Position mode: one turn of the motor back, at 600 r/min.
    let target = joint.position() - 32_768;
    joint.write(MODE, &[1]);
    joint.write(PROFILE_VELOCITY, &[600, 0]);
    joint.write(CONTROLWORD, &[0x0E]);
    joint.write(TARGET_POSITION, &[target as u16, (target >> 16) as u16]);
    joint.write(CONTROLWORD, &[0x1E]);
    joint.until("bit 10 of the statusword", |joint| joint.word(STATUSWORD) >> 10 & 1 == 1);
    let position = joint.position();
    assert!((position - target).abs() <= 50, "{position} instead of {target}");
    let truth = joint.truth();
    assert!((truth.position - i64::from(target)).abs() <= 50, "{truth:?}");

    // 1/327 V.
    let supply_v = f64::from(joint.word(VOLTAGE)) / 327.0;
    assert!((supply_v - truth.supply_v).abs() < 0.5, "{supply_v} V: {truth:?}");

    // Speed mode: -300 r/min under load, in 0.1 r/min.
    joint.apply("load torque -2");
    joint.write(MODE, &[3]);
    joint.write(TARGET_VELOCITY, &[(-300_i16) as u16, 0xFFFF]);
    joint.until("the speed", |joint| (-3050..=-2950).contains(&(joint.word(SPEED) as i16)));
    // It is no longer sped up.
    joint.0.run_for(Duration::from_millis(500));
    // 1/2000 A, without a sign.
    let (said_a, true_a) = (f64::from(joint.word(CURRENT)) / 2000.0, joint.truth().current_a.abs());
    assert!(true_a > 0.3, "a load that cannot be felt proves nothing: {true_a} A");
    assert!((said_a - true_a).abs() < 0.05 + 0.1 * true_a, "{said_a} A said, {true_a} A true");
}

#[test]
fn only_a_joint_with_power_answers_and_only_its_registers() {
    let mut joint = Bench::new();
    let read = |joint: &mut Bench, address| joint.asked(JOINT, RegisterAccess::Read { address, count: 1 });
    assert_eq!(read(&mut joint, 0x27), Some(Err(ModbusException::IllegalDataAddress)));
    // "0: modbus forbid" (5.04, 2600h): only 2600h itself is written.
    assert_eq!(joint.written(MODE, &[3]), Some(Err(ModbusException::IllegalFunction)));
    joint.write(MODBUS_ENABLE, &[1]);
    assert_eq!(joint.written(VOLTAGE, &[1]), Some(Err(ModbusException::IllegalDataAddress)));
    assert_eq!(joint.written(MODE, &[2]), Some(Err(ModbusException::IllegalDataValue)));
    for unit in [0, 1, 4] {
        assert_eq!(joint.asked(unit, RegisterAccess::Read { address: 0, count: 1 }), None, "{unit}");
    }
    joint.apply("power off");
    // It answers for as long as the charge of its bus lasts.
    assert!(read(&mut joint, 0).is_some());
    joint.until("its silence", |joint| read(joint, 0).is_none());
    joint.apply("power on");
    joint.until("the joint", |joint| read(joint, 0).is_some_and(|answer| answer.is_ok()));
}
