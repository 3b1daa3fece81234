//! What is joined to an output shaft, from the words of a person at the machine: ranges, units, places.

use devices::AxisId;
use plant::attachment::{Attachment, Fan, LoadGear, Pulley, Spring, Stops, Stribeck};
use plant::mechanics::Load;

use super::Machine;
use super::assembly::Assembly;
use super::quantity::QuantityRange;
use super::switch::stretch;
use crate::stimulus::{Friction, LoadKind, LoadPart, SwitchRange};
use crate::{Refused, VirtualDrive};

const FRICTION: QuantityRange =
    QuantityRange { what: "friction", expected: "0 to 1000 N·m", least: 0.0, greatest: 1000.0 };
const VISCOUS: QuantityRange =
    QuantityRange { what: "viscous friction", expected: "0 to 1000 N·m·s/rad", least: 0.0, greatest: 1000.0 };
const STRIBECK: QuantityRange =
    QuantityRange { what: "Stribeck velocity", expected: "0.0001 to 100 rad/s", least: 1e-4, greatest: 100.0 };
const MASS: QuantityRange = QuantityRange { what: "mass", expected: "0 to 10000 kg", least: 0.0, greatest: 10_000.0 };
const RADIUS: QuantityRange =
    QuantityRange { what: "radius of the drum", expected: "-10 to 10 m", least: -10.0, greatest: 10.0 };
const SPRING: QuantityRange =
    QuantityRange { what: "stiffness of the spring", expected: "0 to 1e6 N·m/rad", least: 0.0, greatest: 1e6 };
const REST: QuantityRange =
    QuantityRange { what: "angle of rest", expected: "-360000 to 360000 degrees", least: -3.6e5, greatest: 3.6e5 };
const STOP: QuantityRange =
    QuantityRange { what: "stiffness of the stops", expected: "1 to 1e7 N·m/rad", least: 1.0, greatest: 1e7 };
const DAMPING: QuantityRange =
    QuantityRange { what: "damping of the stops", expected: "0 to 1e5 N·m·s/rad", least: 0.0, greatest: 1e5 };
const FAN_TORQUE: QuantityRange =
    QuantityRange { what: "torque of the fan", expected: "0 to 1000 N·m", least: 0.0, greatest: 1000.0 };
const FAN_SPEED: QuantityRange =
    QuantityRange { what: "speed of the fan", expected: "1 to 100000 r/min", least: 1.0, greatest: 1e5 };
const RATIO: QuantityRange =
    QuantityRange { what: "ratio of the gear", expected: "0.01 to 1000", least: 0.01, greatest: 1000.0 };
const BACKLASH: QuantityRange =
    QuantityRange { what: "backlash", expected: "0 to 90 degrees", least: 0.0, greatest: 90.0 };
const GEAR: QuantityRange =
    QuantityRange { what: "stiffness of the gear", expected: "1 to 1e7 N·m/rad", least: 1.0, greatest: 1e7 };

/// Assumed: the gear of a machine winds up by a tenth of a degree under 10 N·m, as a light spur gear's shafts do.
const GEAR_STIFFNESS_NM_RAD: f64 = 5000.0;
/// Assumed: friction at rest goes over into friction of motion within a turn in ten seconds or so.
const STRIBECK_RAD_S: f64 = 0.5;
/// Assumed: damping of a buffer over the critical one: it throws a load back with about a third of its speed.
const STOP_DAMPING: f64 = 0.3;

impl<A: Assembly> Machine<A> {
    /// Joins one thing to a shaft, or takes it away. A refusal changes nothing.
    pub(super) fn join_load(&mut self, axis: AxisId, part: &LoadPart) -> Result<(), Refused> {
        let (_, rig) = self.assembly.shaft_and_rig(axis);
        let (mut load, mut what) = (rig.load, rig.attachment());
        match *part {
            LoadPart::Friction(friction) => rub(&friction, &mut load, &mut what)?,
            LoadPart::Pulley { mass_kg, radius_m } => {
                let (mass_kg, radius_m) = (MASS.check(mass_kg)?, RADIUS.check(radius_m)?);
                what.pulley = Some(Pulley { mass_kg, radius_m });
            }
            LoadPart::Spring { stiffness_nm_rad, rest_deg } => {
                let stiffness_nm_rad = SPRING.check(stiffness_nm_rad)?;
                let rest = self.assembly.shaft_facts(axis).load_angle.advanced_by(REST.check(rest_deg)? / 360.0);
                what.spring = Some(Spring { stiffness_nm_rad, rest });
            }
            LoadPart::Stop { range, stiffness_nm_rad, damping_nm_s_rad } => {
                let usual = A::LOAD_TORQUE.greatest;
                let stiffness = STOP.check(stiffness_nm_rad.unwrap_or(usual))?;
                let damping = damping_nm_s_rad.map_or_else(|| self.stop_damping(axis, stiffness), Ok)?;
                what.stops = Some(self.stops(axis, range, stiffness, DAMPING.check(damping)?)?);
            }
            LoadPart::Fan { torque_nm, speed_rpm } => {
                let velocity_rad_s = FAN_SPEED.check(speed_rpm)? * cia402::RAD_S_PER_RPM;
                what.fan = Some(Fan { torque_nm: FAN_TORQUE.check(torque_nm)?, velocity_rad_s });
            }
            LoadPart::Gear { ratio, backlash_deg, stiffness_nm_rad } => {
                self.check_gear(axis, &what)?;
                what.gear = Some(LoadGear {
                    ratio: RATIO.check(ratio)?,
                    backlash_rad: BACKLASH.check(backlash_deg)?.to_radians(),
                    stiffness_nm_rad: GEAR.check(stiffness_nm_rad.unwrap_or(GEAR_STIFFNESS_NM_RAD))?,
                });
            }
            LoadPart::Off(LoadKind::Gear) => {
                self.check_gear(axis, &what)?;
                what.gear = None;
            }
            LoadPart::Off(kind) => take_off(kind, &mut load, &mut what),
            LoadPart::None => {
                load = Load { locked: load.locked, ..Load::default() };
                what = Attachment::default();
            }
        }
        self.assembly.rig_mut(axis).load = load;
        self.assembly.attach(axis, what);
        Ok(())
    }

    /// Behind another gear a spring and stops would stand elsewhere.
    fn check_gear(&self, axis: AxisId, what: &Attachment) -> Result<(), Refused> {
        let model = self.model();
        if self.assembly.shaft_facts(axis).reducer.is_some() {
            return Err(Refused::Absent { model, what: "room for a second gear: its load hangs on its own reducer" });
        }
        if self.assembly.shaft_and_rig(axis).1.is_coupled() {
            return Err(Refused::Absent { model, what: "room for a gear: its shaft is part of a coupled machine" });
        }
        if what.spring.is_some() || what.stops.is_some() { Err(Refused::Placed) } else { Ok(()) }
    }

    /// What damps a stop well: a share of the critical damping.
    fn stop_damping(&self, axis: AxisId, stiffness_nm_rad: f64) -> Result<f64, Refused> {
        let (facts, (_, rig)) = (self.assembly.shaft_facts(axis), self.assembly.shaft_and_rig(axis));
        let ratio = self.ratio(axis);
        let inertia = facts.rotor_inertia_kg_m2 * ratio * ratio + rig.attachment().inertia_kg_m2(&rig.load);
        Ok((2.0 * STOP_DAMPING * (stiffness_nm_rad * inertia).sqrt()).min(DAMPING.greatest))
    }

    /// Motor turns per turn of the load.
    fn ratio(&self, axis: AxisId) -> f64 {
        let gear = self.assembly.shaft_and_rig(axis).1.attachment().gear;
        self.assembly.shaft_facts(axis).reducer.unwrap_or(gear.map_or(1.0, |gear| gear.ratio))
    }

    fn stops(&self, axis: AxisId, range: SwitchRange, stiffness: f64, damping: f64) -> Result<Stops, Refused> {
        let position = i64::from(drives::Firmware::report(&self.firmware, axis).position_counts);
        if !range.contains(position) {
            return Err(Refused::BeyondStops { position });
        }
        let shaft = self.assembly.shaft_counts(axis);
        let scale = self.assembly.shaft_counts_per_count(&self.firmware, axis);
        let reversed = self.assembly.counts_reversed(&self.firmware, axis);
        let facts = self.assembly.shaft_facts(axis);
        let per_load_turn = f64::from(facts.counts_per_turn) * self.ratio(axis);
        let place = |at: i64| facts.load_angle.advanced_by(at.saturating_sub(shaft) as f64 / per_load_turn);
        let SwitchRange { low, high } = stretch(range, position, shaft, scale, reversed);
        let (low, high) = (low.map(place), high.map(place));
        Ok(Stops { low, high, stiffness_nm_rad: stiffness, damping_nm_s_rad: damping })
    }
}

fn rub(friction: &Friction, load: &mut Load, what: &mut Attachment) -> Result<(), Refused> {
    let coulomb_nm = FRICTION.check(friction.coulomb_nm)?;
    let viscous_nm_s = VISCOUS.check(friction.viscous_nm_s)?;
    let velocity_rad_s = STRIBECK.check(friction.stribeck_rad_s.unwrap_or(STRIBECK_RAD_S))?;
    let static_nm = friction.static_nm.map(|static_nm| FRICTION.check(static_nm)).transpose()?;
    if let Some(static_nm) = static_nm
        && static_nm < coulomb_nm
    {
        let expected = "not less than the friction in motion";
        return Err(Refused::OutOfRange { what: "friction at rest", expected, value: static_nm });
    }
    what.stribeck = static_nm.map(|static_nm| Stribeck { static_nm, velocity_rad_s });
    (load.coulomb_nm, load.viscous_nm_s) = (coulomb_nm, viscous_nm_s);
    Ok(())
}

fn take_off(kind: LoadKind, load: &mut Load, what: &mut Attachment) {
    match kind {
        LoadKind::Friction => {
            (load.coulomb_nm, load.viscous_nm_s) = (0.0, 0.0);
            what.stribeck = None;
        }
        LoadKind::Pulley => what.pulley = None,
        LoadKind::Spring => what.spring = None,
        LoadKind::Stop => what.stops = None,
        LoadKind::Fan => what.fan = None,
        LoadKind::Gear => what.gear = None,
    }
}
