//! A ZLAC8030L on its hardware: hub motor, load, brake, supply and EEPROM as the assembly of a machine.
//!
//! In go the power stage, bleeder, outputs and brake of the firmware, out come its sensors and the report for people.
//! Figures of the motor are those of `plant`; what is assumed of the surroundings is a constant below.

use drives::engine::axis::Demand;
use drives::engine::storage::Image;
use drives::zlac8030l::hardware::{Actuation, Hardware, PowerStage, Sensors};
use drives::zlac8030l::readings::REFERENCE_V;
use drives::zlac8030l::{Zlac8030l, objects, storage};
use plant::angle::Angle;
use plant::encoder::EncoderFault;
use plant::hall::HallFault;
use plant::hub_motor::{self, HubMotor, HubMotorModel, Inverter};
use plant::pmsm::Phase;

use super::Machine;
use super::assembly::{Assembly, within};
use crate::{Brake, Component, Levels, Refused, Report, TemperatureSensor};

const OUTPUTS: &[&str] = &["Y0", "Y1"];
const PERIOD_S: f64 = <Zlac8030l as drives::Firmware>::CONTROL_PERIOD_NS as f64 * 1e-9;
const SUPPLY_V: f64 = 48.0;
const AMBIENT_C: f64 = 25.0;

/// The drive's own converter starts above and stops below these bus voltages. Assumed: far below the under-voltage
/// fault, which needs the firmware to run.
const START_V: f64 = 12.0;
const STOP_V: f64 = 9.0;

/// Assumed: the external brake of chapter 5.5 of the ZLAC8030L quick start guide V1.00, able to hold the wheel
/// motor's rated torque (6 N·m, see [`HubMotorModel::ZLLG65ASM250_L`]).
const BRAKE_NM: f64 = 6.0;

const RPM_PER_RAD_S: f64 = 30.0 / core::f64::consts::PI;

/// A ZLAC8030L with its wheel, as a station of a world.
pub type Zlac8030lMachine = Machine<HubWheel>;

/// A ZLAC8030L as delivered but for its address, with a hub motor and brake, on 48 V, without power.
///
/// `node` 1 to 3 is set at the DIP switches; any other number is stored in the EEPROM. `baud_rate` is the value of
/// 200Eh in the EEPROM.
pub fn zlac8030l(node: u8, baud_rate: u16) -> Zlac8030lMachine {
    let dip_address = if node <= 3 { node } else { 0 };
    Machine::new(Zlac8030l::new(), HubWheel::new(dip_address, storage::with_address(node, baud_rate)))
}

/// Motor, load, supply and memory of a ZLAC8030L.
#[derive(Clone, Debug)]
pub struct HubWheel {
    motor: HubMotor,
    dip_address: u8,
    image: Image,
    eeprom_broken: bool,
    reference_broken: bool,
    last: Actuation,
}

impl HubWheel {
    /// At rest at ambient temperature, the supply not yet connected.
    pub fn new(dip_address: u8, image: Image) -> Self {
        let mut model = HubMotorModel::ZLLG65ASM250_L;
        model.brake.holding_nm = BRAKE_NM;
        let mut motor = HubMotor::new(model, Angle::default(), SUPPLY_V, AMBIENT_C);
        motor.rig.supply.connected = false;
        Self { motor, dip_address, image, eeprom_broken: false, reference_broken: false, last: Actuation::default() }
    }

    /// The motor and all that is joined to it.
    pub fn motor(&self) -> &HubMotor {
        &self.motor
    }

    /// The motor and all that is joined to it, to change.
    pub fn motor_mut(&mut self) -> &mut HubMotor {
        &mut self.motor
    }
}

impl Assembly for HubWheel {
    type Firmware = Zlac8030l;

    const MODEL: &'static str = "zlac8030l";
    const INPUTS: &'static [&'static str] = &["X0", "X1"];

    fn hardware(&self) -> Hardware {
        Hardware { dip_address: self.dip_address, eeprom: self.image }
    }

    #[inline]
    fn sense(&self, inputs: u32) -> Sensors {
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
        }
    }

    #[inline]
    fn step(&mut self, actuation: &Actuation) {
        self.last = *actuation;
        let inverter = match actuation.power_stage {
            PowerStage::Off => Inverter::Open,
            PowerStage::Shorted => Inverter::Shorted,
            PowerStage::Modulate { duty } => Inverter::Driven(duty.map(f64::from)),
        };
        let pins = hub_motor::Actuation {
            inverter,
            bleeder_on: actuation.bleeder_on,
            brake_released: !actuation.brake_engaged,
        };
        self.motor.step(PERIOD_S, &pins);
    }

    fn report(&self, firmware: &Zlac8030l, running: bool) -> Report {
        let own = drives::Firmware::report(firmware);
        let demand = demands(firmware, self.motor.model.encoder.counts_per_turn());
        let rotor = &self.motor.rotor;
        Report {
            node: own.node_id.raw(),
            powered: running,
            statusword: running.then(|| firmware.values().get(objects::STATUSWORD)),
            error_code: u32::from(own.fault_code),
            position: i64::from(own.position_counts),
            rotor_position: None,
            position_demand: demand.position,
            velocity_rpm: direction(self, firmware) * rotor.velocity_rad_s * RPM_PER_RAD_S,
            velocity_demand_rpm: demand.velocity_rpm,
            current_a: f64::from(own.current_a),
            current_demand_a: demand.current_a,
            supply_v: self.motor.rig.supply.bus_v,
            motor_c: Some(self.motor.rig.winding.temperature_c),
            driver_c: Some(self.motor.rig.heat_sink.temperature_c),
            outputs: Levels {
                names: OUTPUTS,
                bits: u32::from(self.last.outputs[0]) | u32::from(self.last.outputs[1]) << 1,
            },
            brake: Some(if self.last.brake_engaged { Brake::Engaged } else { Brake::Released }),
            shaft_angle_rad: rotor.angle.as_rad(),
        }
    }

    fn connect_supply(&mut self, on: bool) {
        let supply = &mut self.motor.rig.supply;
        if on && !supply.connected {
            // The inrush limiter has charged the capacitor by the time the drive's converter starts.
            supply.bus_v = supply.bus_v.max(supply.source_v);
        }
        supply.connected = on;
    }

    fn supplies_firmware(&self, running: bool) -> bool {
        self.motor.rig.supply.bus_v >= if running { STOP_V } else { START_V }
    }

    #[inline]
    fn shaft_counts(&self) -> i64 {
        self.motor.rotor.angle.count(self.motor.model.encoder.counts_per_turn())
    }

    fn counts_reversed(&self, firmware: &Zlac8030l) -> bool {
        firmware.values().get(objects::MOTOR_DIRECTION) != 0
    }

    fn image(&self) -> &[u8] {
        &self.image.0
    }

    fn keep_image(&mut self, image: &[u8]) {
        self.image = Image::from_bytes(image);
    }

    fn set_load_torque(&mut self, torque_nm: f64) -> Result<(), Refused> {
        self.motor.rig.load.torque_nm = within("load torque", "-1000 to 1000 N·m", -1000.0..=1000.0, torque_nm)?;
        Ok(())
    }

    fn set_load_inertia(&mut self, inertia_kg_m2: f64) -> Result<(), Refused> {
        self.motor.rig.load.inertia_kg_m2 = within("load inertia", "0 to 1000 kg·m²", 0.0..=1000.0, inertia_kg_m2)?;
        Ok(())
    }

    fn set_rotor_locked(&mut self, locked: bool) {
        self.motor.rig.load.locked = locked;
    }

    fn set_supply(&mut self, supply_v: f64) -> Result<(), Refused> {
        let supply = &mut self.motor.rig.supply;
        supply.source_v = within("supply", "0 to 100 V", 0.0..=100.0, supply_v)?;
        // A supply that is turned down discharges its own output; only the motor's energy it cannot take.
        if supply.connected {
            supply.bus_v = supply.bus_v.min(supply_v);
        }
        Ok(())
    }

    fn hold_temperature(&mut self, sensor: TemperatureSensor, celsius: Option<f64>) -> Result<(), Refused> {
        if let Some(celsius) = celsius {
            within("temperature", "-55 to 200 °C", -55.0..=200.0, celsius)?;
        }
        let body = match sensor {
            TemperatureSensor::Motor => &mut self.motor.rig.winding,
            TemperatureSensor::Driver => &mut self.motor.rig.heat_sink,
        };
        body.hold_c = celsius;
        Ok(())
    }

    fn set_fault(&mut self, component: Component, broken: bool) -> Result<(), Refused> {
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
        }
        Ok(())
    }
}

/// +1, or -1 for a drive that counts against the shaft's own direction.
fn direction(wheel: &HubWheel, firmware: &Zlac8030l) -> f64 {
    if wheel.counts_reversed(firmware) { -1.0 } else { 1.0 }
}

/// Set-points of the control loops, in the units of a report.
#[derive(Default)]
struct Demands {
    position: Option<i64>,
    velocity_rpm: Option<f64>,
    current_a: Option<f64>,
}

fn demands(firmware: &Zlac8030l, counts_per_turn: u32) -> Demands {
    let rpm = |counts_s: f64| Some(counts_s * 60.0 / f64::from(counts_per_turn));
    match *firmware.demand() {
        Demand::Off => Demands::default(),
        Demand::Position(point) => {
            Demands { position: Some(i64::from(point.position)), velocity_rpm: rpm(point.velocity), current_a: None }
        }
        Demand::Velocity(point) => Demands { velocity_rpm: rpm(point.velocity), ..Demands::default() },
        Demand::Torque(current_a) => Demands { current_a: Some(f64::from(current_a)), ..Demands::default() },
    }
}
