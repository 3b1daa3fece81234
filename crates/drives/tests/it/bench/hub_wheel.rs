//! A ZLAC8030L on the slow winding of a hub motor at 48 V.

use canopen::od::Table;
use drives::zlac8030l::objects::TABLE;
use drives::zlac8030l::{Actuation, PowerStage, Sensors, Zlac8030l};
use plant::{Angle, HubMotor, HubMotorModel, Inverter};

use super::{Bench, Rig};

pub(crate) struct HubWheel(HubMotor);

impl Bench<HubWheel> {
    /// A drive as delivered, switched on and booted, without the watch over the host.
    pub(crate) fn new() -> Self {
        let motor = HubMotor::new(HubMotorModel::ZLLG65ASM250_L, Angle::new(0, 0.123), 48.0, 25.0);
        let mut bench = Self::unpowered(Zlac8030l::new(), HubWheel(motor), 4);
        bench.power_on();
        bench.write(0x2000, 0, 0);
        bench
    }

    /// 06, 07, 0F in a mode.
    pub(crate) fn enable(&mut self, mode: i64) {
        self.write(0x6060, 0, mode);
        for word in [0x06, 0x07, 0x0F] {
            self.controlword(word);
            self.run_ms(1);
        }
        assert_eq!(self.statusword() & 0x6F, 0x27);
    }
}

impl Rig for HubWheel {
    type Drive = Zlac8030l;

    const TABLE: &'static Table = &TABLE;

    fn sensors(&self) -> Sensors {
        let read = self.0.sense();
        Sensors {
            encoder_count: read.encoder_count,
            encoder_wired: true,
            hall: read.hall,
            phase_current_a: [read.phase_current_a[0] as f32, read.phase_current_a[1] as f32],
            bus_v: read.bus_v as f32,
            motor_c: read.winding_c as f32,
            driver_c: read.heat_sink_c as f32,
            ..Sensors::default()
        }
    }

    fn step(&mut self, dt_s: f64, actuation: &Actuation) {
        let inverter = match actuation.power_stage {
            PowerStage::Off => Inverter::Open,
            PowerStage::Shorted => Inverter::Shorted,
            PowerStage::Modulate { duty } => Inverter::Driven(duty.map(f64::from)),
            PowerStage::Follow(_) => unreachable!("of fidelity full"),
        };
        let brake_released = !actuation.brake_engaged;
        self.0.step(dt_s, &plant::Actuation { inverter, bleeder_on: actuation.bleeder_on, brake_released });
    }

    fn velocity_rad_s(&self) -> f64 {
        self.0.rotor.velocity_rad_s
    }
}
