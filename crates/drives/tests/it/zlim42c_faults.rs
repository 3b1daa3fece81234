//! Faults of the ZLIM42-C that a sound motor cannot cause, fed to the firmware's pins.

use can::{CanId, Frame, Instant, Station};
use drives::Firmware;
use drives::engine::storage::StoredImage;
use drives::zlim42c::{Actuation, Hardware, PowerStage, Sensors, Zlim42c, objects};

struct Pins {
    drive: Zlim42c,
    sensors: Sensors,
    now: Instant,
    actuation: Actuation,
    sent: Vec<String>,
}

impl Pins {
    fn new(eeprom: StoredImage) -> Self {
        let mut drive = Zlim42c::new();
        drive.power_on(&Hardware { eeprom, ..Hardware::default() }, Instant::ZERO);
        let (sensors, now) = (Sensors::default(), Instant::ZERO);
        let mut pins = Self { drive, sensors, now, actuation: Actuation::default(), sent: Vec::new() };
        pins.run_ms(5);
        pins
    }

    fn run_ms(&mut self, ms: u32) {
        (0..20 * ms).for_each(|_| self.tick());
    }

    fn tick(&mut self) {
        self.now = self.now.plus_nanos(Zlim42c::CONTROL_PERIOD_NS);
        self.actuation = self.drive.tick(&self.sensors, self.now);
        self.drive.handle_timeout(self.now);
        while let Some(frame) = self.drive.poll_transmit() {
            self.drive.handle_transmitted(&frame, self.now);
            self.sent.push(frame.to_string());
        }
    }

    fn write(&mut self, index: u16, value: u16) {
        let [low, high] = index.to_le_bytes();
        let [a, b] = value.to_le_bytes();
        let request = Frame::full(CanId::standard(0x601), [0x2B, low, high, 0, a, b, 0, 0]);
        self.drive.handle_frame(&request, self.now);
        self.run_ms(1);
    }

    fn code(&self) -> u16 {
        self.drive.values().get(objects::ERROR_CODE)
    }
}

#[test]
fn over_current_switches_off_in_the_control_period_in_which_it_is_measured() {
    for phase_current_a in [[7.0, 0.0], [0.0, -7.0], [f32::NAN, 0.0]] {
        let mut pins = Pins::new(Hardware::default().eeprom);
        for word in [0x06, 0x07] {
            pins.write(0x6040, word);
        }
        assert_ne!(pins.actuation.power_stage, PowerStage::Off, "energised from switched on");
        pins.sensors.phase_current_a = phase_current_a;
        pins.tick();
        assert_eq!(pins.actuation.power_stage, PowerStage::Off);
        assert_eq!(pins.code(), 0xFF02);
        pins.run_ms(5);
        assert!(pins.sent.contains(&"081#02FF030000000000".to_owned()), "{:?}", pins.sent);
    }
}

#[test]
fn bus_over_current_is_the_mean_of_10_ms_and_flashes_five_times() {
    let mut pins = Pins::new(Hardware::default().eeprom);
    // Half of the time twice the limit less a little, and short peaks, are borne.
    for period in 0..2000 {
        pins.sensors.bus_current_a = if period % 2 == 0 { 6.0 } else { 0.0 };
        pins.tick();
    }
    pins.sensors.bus_current_a = 20.0;
    pins.run_ms(5);
    pins.sensors.bus_current_a = 0.0;
    pins.run_ms(5);
    assert_eq!(pins.code(), 0);
    pins.sensors.bus_current_a = 3.3;
    pins.run_ms(12);
    assert_eq!(pins.code(), 0xFF02);
    assert!(pins.sent.contains(&"081#02FF030000000000".to_owned()), "{:?}", pins.sent);
    let (mut flashes, mut was_on) = (0, pins.actuation.led.red);
    // Five flashes of 0.4 s and a pause of 1 s.
    for _ in 0..3000 {
        pins.run_ms(1);
        flashes += u32::from(pins.actuation.led.red && !was_on);
        was_on = pins.actuation.led.red;
    }
    assert_eq!(flashes, 5);
}

#[test]
fn a_blank_eeprom_is_a_fault_that_factory_settings_end() {
    let mut pins = Pins::new(StoredImage::BLANK);
    assert_eq!(pins.code(), 0xFF10);
    pins.write(0x2010, 1);
    pins.run_ms(5);
    assert_eq!(pins.code(), 0);
    let image = StoredImage::from_bytes(pins.drive.eeprom().0);
    assert_eq!(Pins::new(image).code(), 0, "the next start finds them");
}

#[test]
fn a_reading_that_is_no_number_is_a_fault_and_never_a_duty_cycle() {
    let mut pins = Pins::new(Hardware::default().eeprom);
    for word in [0x06, 0x07, 0x0F] {
        pins.write(0x6040, word);
    }
    pins.sensors.bus_v = f32::NAN;
    for _ in 0..100 {
        pins.tick();
        if let PowerStage::Modulate { duty } = pins.actuation.power_stage {
            assert!(duty.iter().all(|duty| duty.abs() <= 1.0), "{duty:?}");
        }
    }
    assert_eq!(pins.code(), 0xFF01);
}
