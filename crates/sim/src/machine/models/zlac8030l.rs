//! A ZLAC8030L on its hardware: hub motor, load, brake, supply and EEPROM as the assembly of a machine.
//!
//! In go the power stage, bleeder, outputs and brake of the firmware, out come its sensors and the report for people.
//! Figures of the motor are those of `plant`; what is assumed of the surroundings is a constant below.

use std::sync::Arc;

use canopen::Mux;
use devices::variant::Variant;
use devices::zltech::ZLAC8030L;
use devices::{AxisId, Description};
use drives::Fidelity;
use drives::engine::device::ResetTimes;
use drives::engine::storage::StoredImage;
use drives::zlac8030l::assumptions::REFERENCE_V;
use drives::zlac8030l::hardware::{Actuation, Hardware, PowerStage, Sensors};
use drives::zlac8030l::variations::{FAST_MOTOR, VARIANT};
use drives::zlac8030l::{Zlac8030l, objects, storage};
use plant::FreeRun;
use plant::angle::Angle;
use plant::encoder::EncoderFault;
use plant::hall::HallFault;
use plant::hub_motor::{self, HubMotor, HubMotorModel, Inverter};
use plant::pmsm::Phase;
use plant::rest::is_at_rest;
use plant::supply::SupplyData;

use super::following::{current_loop, followed};
use super::order::{Order, OrderError, baud_rate};
use crate::machine::kernel::Machine;
use crate::machine::kernel::assembly::{AMBIENT_C, Assembly, with_demand};
use crate::machine::kernel::realism::{
    HUB_COGGING, LARGE_CURRENT_STEP_A, Noise, Realism, TEMPERATURE_STEP_C, VOLTAGE_STEP_V, with_dead_time,
};
use crate::{Brake, Component, Levels, Refused, Report, VirtualDrive};

const OUTPUTS: &[&str] = &["Y0", "Y1"];
const SUPPLY_V: f64 = 48.0;

/// Assumed: the external brake of chapter 5.5 of the ZLAC8030L quick start guide V1.00, able to hold the wheel
/// motor's rated torque (6 N·m, see [`HubMotorModel::ZLLG65ASM250_L`]).
const BRAKE_NM: f64 = 6.0;

/// What has been destroyed, and what to do about it.
const SEIZED: &str = "bearings seized by over-speed: 'rotor free' puts in new ones";
const BURNT: &str = "power stage burnt: 'fault bridge off' fits a new one, 'power cycle' starts it";
const BLEEDER_BURNT: &str = "bleeder resistor burnt, it takes no power: 'fault bleeder off' fits a new one";

/// A ZLAC8030L with its wheel, as a station of a world.
pub type Zlac8030lMachine = Machine<HubWheel>;

/// A ZLAC8030L as delivered but for its address, with a hub motor and brake, on 48 V, without power.
///
/// `node` 1 to 3 is set at the DIP switches; any other number is stored in the EEPROM. `baud_rate` is the value of
/// 200Eh in the EEPROM.
pub fn zlac8030l(node: u8, baud_rate: u16) -> Zlac8030lMachine {
    let image = StoredImage::of(&storage::addressed(&VARIANT, node, baud_rate));
    Machine::new(Zlac8030l::new(), HubWheel::new(dip_address(node), image, &VARIANT))
}

/// Bit rates by number.
const BAUD_RATE: Mux = Mux::new(0x200E, 0);

/// The same as it was ordered.
pub(super) fn ordered(model: &Description, order: &Order) -> Result<Box<dyn VirtualDrive>, OrderError> {
    let (node, variant) = (order.node.raw(), order.variant);
    let baud_rate = baud_rate(model, BAUD_RATE, order.bitrate)?;
    let image = order.image(storage::addressed(&variant, node, baud_rate))?;
    Ok(Box::new(Machine::new(Zlac8030l::of(variant), HubWheel::new(dip_address(node), image, &variant))))
}

/// What the DIP switches of a drive for this node-ID are set to.
const fn dip_address(node: u8) -> u8 {
    if node <= 3 { node } else { 0 }
}

/// Motor, load, supply and memory of a ZLAC8030L.
#[derive(Clone, Debug)]
pub struct HubWheel {
    motor: HubMotor,
    dip_address: u8,
    /// Shared by all copies of a world until one of them loses power.
    image: Arc<StoredImage>,
    eeprom_broken: bool,
    reference_broken: bool,
    dead_time: bool,
    last: Actuation,
}

impl HubWheel {
    /// At rest at ambient temperature, the supply not yet connected, with the motor of this variant.
    pub fn new(dip_address: u8, image: StoredImage, variant: &Variant) -> Self {
        let fast = variant.is(FAST_MOTOR);
        let mut model = if fast { HubMotorModel::ZLLG65ASM250 } else { HubMotorModel::ZLLG65ASM250_L };
        model.brake.holding_nm = BRAKE_NM;
        let mut motor = HubMotor::new(model, Angle::default(), SUPPLY_V, AMBIENT_C);
        motor.rig.supply = SupplyData::switched_off(SUPPLY_V);
        Self {
            motor,
            dip_address,
            image: Arc::new(image),
            eeprom_broken: false,
            reference_broken: false,
            dead_time: false,
            last: Actuation::default(),
        }
    }

    /// The motor and all that is joined to it.
    pub fn motor(&self) -> &HubMotor {
        &self.motor
    }

    fn damage(&self) -> Option<&'static str> {
        let seized = self.motor.is_seized().then_some(SEIZED);
        let bleeder = self.motor.rig.supply.bleeder_burnt.then_some(BLEEDER_BURNT);
        self.motor.is_power_stage_burnt().then_some(BURNT).or(seized).or(bleeder)
    }

    /// The motor and all that is joined to it, to change.
    pub fn motor_mut(&mut self) -> &mut HubMotor {
        &mut self.motor
    }
}

impl Assembly for HubWheel {
    type Firmware = Zlac8030l;
    type Motor = HubMotor;

    const MODEL: &'static str = ZLAC8030L.name;
    const INPUTS: &'static [&'static str] = &["X0", "X1"];

    fn hardware(&self) -> Hardware {
        Hardware { dip_address: self.dip_address, eeprom: *self.image }
    }

    fn set_reset_times(firmware: &mut Self::Firmware, times: ResetTimes) {
        firmware.set_reset_times(times);
    }

    #[inline]
    fn sense(&self, inputs: u64) -> Sensors {
        let sensed = self.motor.sense();
        Sensors {
            encoder_count: sensed.encoder_count,
            encoder_wired: self.motor.encoder.fault != EncoderFault::Disconnected,
            hall: sensed.hall,
            phase_current_a: [sensed.phase_current_a[0] as f32, sensed.phase_current_a[1] as f32],
            bus_v: sensed.bus_v as f32,
            motor_c: sensed.winding_c as f32,
            driver_c: sensed.heat_sink_c as f32,
            reference_v: if self.reference_broken { 0.0 } else { REFERENCE_V },
            inputs: [inputs & 1 != 0, inputs & 2 != 0],
            eeprom_ok: !self.eeprom_broken,
            followed: None,
        }
    }

    fn set_realism(&mut self, realism: Realism) {
        self.dead_time = realism == Realism::Full;
        self.motor.cogging = self.dead_time.then_some(HUB_COGGING);
    }

    fn disturb(&self, sensors: &mut Sensors, noise: &mut Noise) {
        let off = noise.misplaced_edge(self.motor.rotor.angle, self.motor.model.encoder.counts_per_turn());
        sensors.encoder_count = sensors.encoder_count.wrapping_add_signed(off);
        sensors.phase_current_a = sensors.phase_current_a.map(|a| noise.flicker(a, LARGE_CURRENT_STEP_A));
        sensors.bus_v = noise.flicker(sensors.bus_v, VOLTAGE_STEP_V);
        sensors.motor_c = noise.flicker(sensors.motor_c, TEMPERATURE_STEP_C);
        sensors.driver_c = noise.flicker(sensors.driver_c, TEMPERATURE_STEP_C);
    }

    // Inlined by force: it has a second caller, in periods without firmware.
    #[inline(always)]
    fn step(&mut self, actuation: &Actuation) {
        self.last = *actuation;
        self.motor.step(Self::PERIOD_S, &self.pins(AxisId::FIRST, actuation));
    }

    fn set_fidelity(&mut self, fidelity: Fidelity) {
        self.motor.rig.set_long_steps(fidelity == Fidelity::Mechanical);
    }

    fn add_followed(&self, sensors: &mut Sensors) {
        sensors.followed = Some(followed(&self.motor.rotor, &self.motor.pmsm));
    }

    fn step_long(&mut self, firmware: &Zlac8030l, actuation: &Actuation, dt_s: f64) {
        self.last = *actuation;
        if let PowerStage::Follow(demand) = &actuation.power_stage {
            let (gains, motor) = (firmware.current_gains(), &mut self.motor);
            motor.pmsm.current_loop.settings = current_loop(demand, &gains, &motor.model.pmsm, &motor.rotor);
        }
        self.motor.step_long(dt_s, &self.pins(AxisId::FIRST, actuation));
    }

    fn can_rest(&self, actuation: &Actuation, dt_s: f64) -> bool {
        self.motor.rotor.velocity_rad_s == 0.0 && is_at_rest(&self.motor, dt_s, &self.pins(AxisId::FIRST, actuation))
    }

    /// Behind a burnt power stage there is no voltage.
    #[inline]
    fn supplies_firmware(&self, running: bool) -> bool {
        let least_v = if running { Self::STOPS_BELOW_V } else { Self::STARTS_AT_V };
        !self.motor.is_power_stage_burnt() && self.motor.rig.supply.bus_v >= least_v
    }

    fn motor_at(&self, _axis: AxisId) -> &HubMotor {
        &self.motor
    }

    fn motor_at_mut(&mut self, _axis: AxisId) -> &mut HubMotor {
        &mut self.motor
    }

    #[inline]
    fn pins(&self, _axis: AxisId, actuation: &Actuation) -> hub_motor::Actuation {
        let inverter = match actuation.power_stage {
            PowerStage::Off => Inverter::Open,
            PowerStage::Shorted => Inverter::Shorted,
            PowerStage::Modulate { duty } if self.dead_time => {
                Inverter::Driven(with_dead_time(duty.map(f64::from), self.motor.phase_current_a()))
            }
            PowerStage::Modulate { duty } => Inverter::Driven(duty.map(f64::from)),
            PowerStage::Follow(_) => Inverter::Regulated,
        };
        hub_motor::Actuation { inverter, bleeder_on: actuation.bleeder_on, brake_released: !actuation.brake_engaged }
    }

    fn report(&self, firmware: &Zlac8030l, _axis: AxisId, common: Report) -> Report {
        let counts_per_turn = f64::from(self.motor.model.encoder.counts_per_turn());
        let report = Report {
            statusword: common.powered.then(|| firmware.values().get(objects::STATUSWORD)),
            outputs: Levels::new(OUTPUTS, &self.last.outputs),
            damage: self.damage(),
            brake: Some(if self.last.brake_engaged { Brake::Engaged } else { Brake::Released }),
            ..common
        };
        with_demand(firmware.demand(), |counts_s| counts_s * 60.0 / counts_per_turn, report)
    }

    #[inline]
    fn counts_per_turn(&self, _axis: AxisId) -> u32 {
        self.motor.model.encoder.counts_per_turn()
    }

    fn free_run(&self, _axis: AxisId) -> Option<FreeRun> {
        let idle = self.last.power_stage == PowerStage::Off;
        idle.then(|| self.motor.free_run(!self.last.brake_engaged)).flatten()
    }

    fn counts_reversed(&self, firmware: &Zlac8030l, _axis: AxisId) -> bool {
        firmware.values().get(objects::MOTOR_DIRECTION) != 0
    }

    fn image(&self) -> &[u8] {
        &self.image.0
    }

    fn keep_image(&mut self, image: &[u8]) {
        self.image = Arc::new(StoredImage::from_bytes(image));
    }

    fn set_rotor_locked(&mut self, _axis: AxisId, locked: bool) {
        self.motor.lock_rotor(locked);
    }

    fn set_fault(&mut self, _axis: AxisId, component: Component, broken: bool) -> Result<(), Refused> {
        match component {
            Component::Hall => {
                self.motor.hall_fault = if broken { HallFault::Disconnected } else { HallFault::None };
            }
            Component::Encoder => {
                self.motor.encoder.fault = if broken { EncoderFault::Disconnected } else { EncoderFault::None };
            }
            Component::Eeprom => self.eeprom_broken = broken,
            Component::Reference => self.reference_broken = broken,
            Component::Phase => self.motor.lost_phase = broken.then_some(Phase::U),
            Component::Bridge if broken => self.motor.burn_power_stage(),
            Component::Bridge => self.motor.mend_power_stage(),
            Component::Short => self.motor.wires_touch = broken,
            Component::Bleeder => self.motor.rig.supply.set_bleeder_burnt(broken),
        }
        Ok(())
    }
}
