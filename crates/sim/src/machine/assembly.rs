use drives::{Firmware, RegisterError};

use crate::{Component, PulseTrain, Refused, Report, TemperatureSensor};

/// One model's hardware: motor, load, supply, sensors, and the memory chip that outlives power.
///
/// Changes take effect from the next control period on.
pub trait Assembly: Clone + Send + 'static {
    /// The firmware that runs on it.
    type Firmware: Firmware<Actuation: Default + Clone + Send, Sensors: Send> + Send + 'static;

    /// The model's name as users type it.
    const MODEL: &'static str;
    /// Names of the digital inputs.
    const INPUTS: &'static [&'static str];

    /// The model's name as users type it, where one assembly serves several.
    fn model(&self) -> &'static str {
        Self::MODEL
    }

    /// What the firmware finds when it wakes.
    fn hardware(&self) -> <Self::Firmware as Firmware>::Hardware;

    /// What the sensors read now; bit `n` of `inputs` is the level of input `n`.
    fn sense(&self, inputs: u32) -> <Self::Firmware as Firmware>::Sensors;

    /// One control period of physics under `actuation`.
    fn step(&mut self, actuation: &<Self::Firmware as Firmware>::Actuation);

    /// What can be measured from outside. `running` is false without power.
    fn report(&self, firmware: &Self::Firmware, running: bool) -> Report;

    /// Connects or disconnects the supply.
    fn connect_supply(&mut self, on: bool);

    /// Whether the voltage is enough for the firmware to run on (`running`), or to start.
    fn supplies_firmware(&self, running: bool) -> bool;

    /// Where the motor shaft truly is, in counts of a fixed size, from an arbitrary zero.
    fn shaft_counts(&self) -> i64;

    /// How many of those are one count of the drive as it is set now.
    fn shaft_counts_per_count(&self, firmware: &Self::Firmware) -> i64 {
        let _ = firmware;
        1
    }

    /// The drive counts against the shaft's own direction.
    fn counts_reversed(&self, firmware: &Self::Firmware) -> bool;

    /// Contents of the memory chip as of the last power-off.
    fn image(&self) -> &[u8];

    /// Puts `image` into the memory chip.
    fn keep_image(&mut self, image: &[u8]);

    /// Torque at the output shaft, positive against positive motion.
    fn set_load_torque(&mut self, torque_nm: f64) -> Result<(), Refused>;

    /// Inertia added at the output shaft.
    fn set_load_inertia(&mut self, inertia_kg_m2: f64) -> Result<(), Refused>;

    /// Blocks the rotor, or frees it.
    fn set_rotor_locked(&mut self, locked: bool);

    /// Voltage of the supply.
    fn set_supply(&mut self, supply_v: f64) -> Result<(), Refused>;

    /// Holds a temperature, or gives it back to the model.
    fn hold_temperature(&mut self, sensor: TemperatureSensor, celsius: Option<f64>) -> Result<(), Refused>;

    /// Breaks or mends a component.
    fn set_fault(&mut self, component: Component, broken: bool) -> Result<(), Refused>;

    /// Connects or disconnects the multi-turn battery, where there is one.
    fn set_battery(&mut self, connected: bool) -> Result<(), Refused> {
        let _ = connected;
        Err(Refused::Absent { model: self.model(), what: "battery" })
    }

    /// Sends pulses to the inputs, where the drive counts them.
    fn set_pulses(&mut self, train: PulseTrain) -> Result<(), Refused> {
        let _ = train;
        Err(Refused::Absent { model: self.model(), what: "pulse input" })
    }

    /// The unit identifier of the firmware's Modbus registers, where it has any.
    fn modbus_unit(firmware: &Self::Firmware) -> Option<u8> {
        let _ = firmware;
        None
    }

    /// Reads the firmware's Modbus registers from `address` on.
    fn read_registers(firmware: &Self::Firmware, address: u16, words: &mut [u16]) -> Result<(), RegisterError> {
        let _ = (firmware, address, words);
        Err(RegisterError::NoSuchAddress)
    }

    /// Writes the firmware's Modbus registers from `address` on, all of them or none.
    fn write_registers(firmware: &mut Self::Firmware, address: u16, words: &[u16]) -> Result<(), RegisterError> {
        let _ = (firmware, address, words);
        Err(RegisterError::NoSuchAddress)
    }
}

/// `value` if it is a number in `range`.
pub(super) fn within(
    what: &'static str,
    expected: &'static str,
    range: core::ops::RangeInclusive<f64>,
    value: f64,
) -> Result<f64, Refused> {
    if range.contains(&value) { Ok(value) } else { Err(Refused::OutOfRange { what, expected, value }) }
}
