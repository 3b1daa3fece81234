//! When a drive lives: its supply's switch, the voltage of its bus, the time that it takes to boot.

use can::Instant;
use devices::AxisId;
use drives::Firmware;

use super::assembly::Assembly;
use super::{Life, Machine, Supply};
use crate::PowerPhase;
use crate::stimulus::Power;

/// How long a supply that is to come back waits for the bus to drain. A motor that is driven from outside feeds the bus
/// for ever: then it is shorted.
const DRAIN_PATIENCE_NS: u64 = 10_000_000_000;

impl<A: Assembly> Machine<A> {
    /// Starts the drive when its voltage comes and stops it when it goes. It lives on whatever charges the bus, but is
    /// started by the supply alone.
    #[inline(never)]
    pub(super) fn watch_supply(&mut self, at: Instant) {
        let lives = self.life != Life::Dead;
        let supplied = self.assembly.supplies_firmware(lives) && (lives || self.supply == Supply::On);
        if supplied != lives {
            if supplied { self.wake(at) } else { self.die(at) }
        }
        if let Life::Booting(due) = self.life
            && due <= at
        {
            self.start(at);
        }
        if let Supply::Cycling(patience) = self.supply {
            self.finish_cycle(patience, at);
        }
    }

    /// Switches on again once the drive has died.
    #[cold]
    fn finish_cycle(&mut self, patience: Instant, at: Instant) {
        let lives = self.life != Life::Dead;
        if lives && at < patience {
            return;
        }
        if lives {
            self.cut_source(at);
        }
        self.switch_on(at);
    }

    fn switch_on(&mut self, at: Instant) {
        self.supply = Supply::On;
        let (rig, model) = self.assembly.rig_and_model_mut();
        rig.switch_source(model, true);
        self.watch_supply(at);
    }

    fn cut_source(&mut self, at: Instant) {
        self.supply = Supply::Off;
        let (rig, model) = self.assembly.rig_and_model_mut();
        rig.cut_source(model);
        self.watch_supply(at);
    }

    /// There is voltage: the firmware follows, at once or when it has booted.
    fn wake(&mut self, at: Instant) {
        self.assembly.set_supplied(true);
        let boot_ns = self.own_time.as_mut().map_or(0, |own_time| own_time.boot_ns());
        self.life = Life::Booting(at.plus_nanos(boot_ns));
    }

    fn start(&mut self, at: Instant) {
        self.life = Life::Running;
        let hardware = self.assembly.hardware();
        self.firmware.power_on(&hardware, at);
        // What a store that was cut short has counted is over.
        self.note_store(at);
    }

    fn die(&mut self, at: Instant) {
        let ran = self.life == Life::Running;
        self.life = Life::Dead;
        self.assembly.set_supplied(false);
        if !ran {
            return;
        }
        let before = self.firmware.eeprom().1;
        self.firmware.power_off(at);
        let (image, generation) = self.firmware.eeprom();
        match &mut self.own_time {
            None => self.assembly.keep_image(image),
            Some(own_time) => {
                own_time.power_off();
                own_time.chip.advance(at);
                // With the last of its voltage a firmware may still store.
                let last = (generation != before).then_some(image);
                own_time.chip.power_off(last, u64::from(generation));
                self.assembly.keep_image(own_time.chip.contents());
            }
        }
        self.actuation = Default::default();
    }

    /// What the drive makes of its supply, for people.
    pub(super) fn phase(&self) -> PowerPhase {
        let runs = self.life == Life::Running && self.firmware.report(AxisId::FIRST).powered;
        match (self.supply, self.life) {
            (Supply::Cycling(_), _) => PowerPhase::Cycling,
            (_, Life::Dead) => PowerPhase::Off,
            (Supply::Off, _) => PowerPhase::Draining,
            _ if runs => PowerPhase::On,
            _ => PowerPhase::Booting,
        }
    }

    pub(super) fn switch_supply(&mut self, power: Power, now: Instant) {
        match power {
            Power::On if self.life != Life::Dead && self.supply != Supply::On => {
                self.supply = Supply::Cycling(now.plus_nanos(DRAIN_PATIENCE_NS));
            }
            Power::On => {
                let ran = self.life == Life::Running;
                self.switch_on(now);
                if !ran {
                    self.wait_for_first_tick();
                }
            }
            Power::Off => {
                self.supply = Supply::Off;
                let (rig, model) = self.assembly.rig_and_model_mut();
                rig.switch_source(model, false);
                self.watch_supply(now);
            }
            Power::Cycle => {
                self.switch_supply(Power::Off, now);
                self.switch_supply(Power::On, now);
            }
            Power::Cut => self.cut_source(now),
        }
    }
}
