//! A person beside the machine: what hands do to it, and what can be measured.

use can::Instant;
use sim::{Component, Report, VirtualDrive};

use super::{Bench, BenchSubject};

impl<S: BenchSubject> Bench<S> {
    /// Does something to the drive, as a person beside the machine.
    pub fn operate<T>(&mut self, act: impl FnOnce(&mut dyn VirtualDrive, Instant) -> T) -> T {
        if !self.bare {
            return self.world.with_drive(S::NODE, act).expect("the drive is there");
        }
        let now = self.world.now();
        let machine = self.world.station_mut::<S::Machine>(self.drive).expect("the drive is there");
        let result = act(machine, now);
        self.world.refresh();
        result
    }

    /// A torque on the shaft, N m: a positive one opposes positive motion.
    #[track_caller]
    pub fn set_load_torque(&mut self, torque_nm: f64) -> &mut Self {
        self.operate(|drive, now| drive.set_load_torque(torque_nm, now)).expect("a shaft");
        self
    }

    /// A torque that grows to this one in so many steps, each some milliseconds long.
    #[track_caller]
    pub fn load_up_to(&mut self, torque_nm: f64, steps: u32, ms: u64) -> &mut Self {
        for step in 1..=steps {
            self.set_load_torque(torque_nm * f64::from(step) / f64::from(steps)).run_ms(ms);
        }
        self
    }

    /// Inertia on the shaft, kg m².
    #[track_caller]
    pub fn set_load_inertia(&mut self, inertia_kg_m2: f64) -> &mut Self {
        self.operate(|drive, now| drive.set_load_inertia(inertia_kg_m2, now)).expect("a shaft");
        self
    }

    /// The shaft is held fast, or not.
    #[track_caller]
    pub fn set_rotor_locked(&mut self, locked: bool) -> &mut Self {
        self.operate(|drive, now| drive.set_rotor_locked(locked, now)).expect("a rotor");
        self
    }

    /// Voltage of the supply.
    #[track_caller]
    pub fn set_supply(&mut self, supply_v: f64) -> &mut Self {
        self.operate(|drive, now| drive.set_supply(supply_v, now)).expect("a supply");
        self
    }

    /// Level of a digital input.
    #[track_caller]
    pub fn set_input(&mut self, input: usize, level: bool) -> &mut Self {
        self.operate(|drive, now| drive.set_input(input, level, now)).expect("an input");
        self
    }

    /// Breaks a component, or mends it.
    #[track_caller]
    pub fn set_fault(&mut self, component: Component, broken: bool) -> &mut Self {
        self.operate(|drive, now| drive.set_fault(component, broken, now)).expect("the drive has it");
        self
    }

    /// A world command, as typed by a person at the machine; it must be accepted.
    #[track_caller]
    pub fn world(&mut self, line: &str) -> &mut Self {
        self.world_answer(line);
        self
    }

    /// The answer to a world command, which must be accepted.
    #[track_caller]
    pub fn world_answer(&mut self, line: &str) -> String {
        let answer = sim::command::answer(&mut self.world, line).expect("a line is answered").json;
        assert!(answer.starts_with("{\"ok\":true"), "{line}: {answer}");
        answer
    }

    /// What a person beside the machine could measure now.
    pub fn report(&mut self) -> Report {
        self.operate(|drive, now| {
            drive.advance(now);
            drive.report()
        })
    }

    /// Off for 0.1 s, and on again until it has booted.
    pub fn power_cycle(&mut self) -> &mut Self {
        self.operate(|drive, now| drive.cut_power(now));
        self.run_ms(100);
        self.operate(|drive, now| drive.set_power(true, now));
        self.run_ms(S::BOOT_MS)
    }

    /// What was written is kept over a power cycle.
    pub fn let_store(&mut self) -> &mut Self {
        S::store(self);
        self
    }

    /// The machine of an [`open`](Self::open) bench, as it is now.
    pub fn machine(&mut self) -> &mut S::Machine {
        assert!(self.bare, "only an open bench shows its machine");
        let now = self.world.now();
        let machine = self.world.station_mut::<S::Machine>(self.drive).expect("the drive is there");
        machine.advance(now);
        machine
    }
}
