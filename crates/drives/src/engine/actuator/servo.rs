//! Control of a synchronous motor with encoder and Hall sensors: position, velocity and current loop.
//!
//! [`sense`](Servo::sense) and [`modulate`](Servo::modulate) run every control period, [`measure`](Servo::measure) and
//! [`control`](Servo::control) every supervision period. Counts and counts/s come in, duty cycles go out; inside it
//! is radians of the shaft and amperes. All signs are the user's: [`ServoModel::direction`] turns them into the motor's.
//!
//! Below the outer loops is the seam of [`Fidelity`]: a power stage that switches takes duty cycles
//! ([`modulate`](Servo::modulate)), one that follows by itself takes the set-point and the setting of the current loop
//! ([`current_demand`](Servo::current_demand)), and answers with [`Followed`]. Nothing above it knows which it is.

use motion::angle::sin_cos_turns;
use motion::cascade::{Cascade, CascadeGains, PositionDemand, VelocityDemand};
use motion::commutation::{Commutation, CommutationModel};
use motion::filter::{LowPass, LowPassGains};
use motion::foc::{FeedForward, Foc, FocGains, FocInput};
pub use motion::frames::Dq;
use motion::frames::{clarke, park};
use motion::limits::symmetric;
use motion::observer::{Observer, ObserverGains};
use motion::pid::PiGains;

use super::observer::{Tracking, TrackingGains};
use crate::Fidelity;
use crate::engine::axis::Demand;

const TAU: f32 = core::f32::consts::TAU;

/// What the drive is configured for: motor and sensors, and the two periods.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoModel {
    /// Encoder, pole pairs, Hall sensors.
    pub commutation: CommutationModel,
    /// 1 when the user's positive sense of rotation is the motor's, -1 when it is the other.
    pub direction: i8,
    /// How velocity is taken from counts.
    pub observer: ObserverGains,
    /// Time between two ticks, s.
    pub control_period_s: f32,
    /// Supervision period, s.
    pub supervision_period_s: f32,
    /// Time between two changes of the duty cycles, of a power stage that takes such, s.
    pub switching_period_s: f32,
    /// What the power stage takes: duty cycles, or the currents that it follows by itself.
    pub fidelity: Fidelity,
}

/// What a power stage is asked for that follows by itself: the current loop, as its closed form.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CurrentDemand {
    /// Set-point in the motor's own sense of rotation.
    pub setpoint_a: Dq,
    /// The electrical angle that the loop commutates at now, in turns.
    pub electrical_turns: f32,
}

/// [`FocGains`] that matter without a sampling period, alike for both axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CurrentGains {
    /// Both controllers: V/A and V/(A s).
    pub controller: PiGains,
    /// What is known of the motor's own voltages; zeros for nothing.
    pub feed_forward: FeedForward,
    /// Share of `bus / sqrt(3)` that may be used.
    pub modulation_limit: f32,
    /// By how much more time the voltage comes late than the loop looks ahead: the rotor has turned on so far.
    pub voltage_lag_s: f32,
}

/// What such a power stage answers, each supervision period, in the motor's own sense of rotation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Followed {
    /// Mean velocity of the shaft over the last period, rad/s.
    pub velocity_rad_s: f32,
    /// Current now, in the frame that the loop commutates in.
    pub current_a: Dq,
    /// The voltage that the loop asks for.
    pub wanted_v: Dq,
    /// The bus cannot give it.
    pub saturated: bool,
}

impl CurrentGains {
    /// Of a loop with this sampling period, whose duty cycles act in the period after the next tick.
    pub(crate) fn of(gains: &FocGains, model: &ServoModel) -> Self {
        Self {
            voltage_lag_s: 1.5 * model.switching_period_s - gains.voltage_delay_s,
            controller: gains.q,
            feed_forward: gains.feed_forward.unwrap_or_default(),
            modulation_limit: gains.modulation_limit,
        }
    }
}

/// How the loops are set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoGains {
    /// Current loop.
    pub foc: FocGains,
    /// Position and velocity loop.
    pub cascade: CascadeGains,
    /// Of the measured velocity.
    pub velocity_filter: LowPassGains,
    /// Of the planned acceleration that is fed forward.
    pub feed_forward_filter: LowPassGains,
    /// Of the current set-point.
    pub torque_filter: LowPassGains,
    /// A tracking observer and its share in the velocity, 0 to 1.
    pub tracking: TrackingGains,
    /// See `tracking`.
    pub tracking_share: f32,
}

/// What the loops keep to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ServoLimits {
    /// Largest current set-point, A.
    pub current_a: f32,
    /// Largest velocity in torque control, rad/s.
    pub velocity_rad_s: f32,
}

/// State of the loops.
#[derive(Clone, Debug, PartialEq)]
pub struct Servo {
    commutation: Commutation,
    observer: Observer,
    tracking: Tracking,
    foc: Foc,
    cascade: Cascade,
    velocity_filter: LowPass,
    feed_forward_filter: LowPass,
    torque_filter: LowPass,
    electrical_turns: f32,
    velocity_rad_s: f32,
    setpoint_a: f32,
    /// Added to what the loops ask for.
    torque_offset_a: f32,
    /// Current along the magnets that is asked for.
    direct_setpoint_a: f32,
    current_a: Dq,
    wanted_v: Dq,
    saturated: bool,
}

impl ServoModel {
    /// Radians of the shaft in one count.
    pub fn rad_per_count(&self) -> f32 {
        TAU / self.commutation.counts_per_turn.max(1) as f32
    }
}

impl Servo {
    /// At rest, with the angle of the Hall sensors.
    pub fn new(model: &ServoModel, hall: u8, count: u16) -> Self {
        Self {
            commutation: Commutation::new(&model.commutation, hall, count),
            observer: Observer::new(count),
            tracking: Tracking::default(),
            foc: Foc::default(),
            cascade: Cascade::default(),
            velocity_filter: LowPass::default(),
            feed_forward_filter: LowPass::default(),
            torque_filter: LowPass::default(),
            electrical_turns: 0.0,
            velocity_rad_s: 0.0,
            setpoint_a: 0.0,
            torque_offset_a: 0.0,
            direct_setpoint_a: 0.0,
            current_a: Dq::default(),
            wanted_v: Dq::default(),
            saturated: false,
        }
    }

    /// Takes in the shaft's sensors: every control period.
    #[inline]
    pub fn sense(&mut self, model: &ServoModel, hall: u8, count: u16) {
        self.electrical_turns = self.commutation.update(&model.commutation, hall, count);
        self.observer.update(&model.observer, count);
    }

    /// The same for a shaft whose encoder is absolute: its electrical angle in turns, and its counts, of which the
    /// lowest 16 bits are enough.
    #[inline]
    pub fn sense_absolute(&mut self, model: &ServoModel, electrical_turns: f32, count: u16) {
        self.electrical_turns = electrical_turns;
        self.observer.update(&model.observer, count);
    }

    /// The same of a power stage that follows by itself, every supervision period.
    // Apart, as the two below, so that a control period stays as small as it is.
    #[cold]
    #[inline(never)]
    pub fn sense_followed(&mut self, model: &ServoModel, hall: u8, count: u16, followed: &Followed) {
        let electrical_turns = self.commutation.follow(&model.commutation, hall, count);
        self.sense_absolute_followed(model, electrical_turns, count, followed);
    }

    /// The same for a shaft whose encoder is absolute.
    #[cold]
    #[inline(never)]
    pub fn sense_absolute_followed(
        &mut self,
        model: &ServoModel,
        electrical_turns: f32,
        count: u16,
        followed: &Followed,
    ) {
        self.electrical_turns = electrical_turns;
        let sign = f32::from(model.direction);
        let per_period = followed.velocity_rad_s * model.control_period_s / model.rad_per_count();
        self.observer.follow(&model.observer, count, per_period);
        self.current_a = Dq { d: followed.current_a.d, q: sign * followed.current_a.q };
        self.wanted_v = followed.wanted_v;
        self.saturated = followed.saturated;
    }

    /// Commutates at an angle (electrical turns) in place of the sensors', until they are looked at again.
    pub const fn commutate_at(&mut self, electrical_turns: f32) {
        self.electrical_turns = electrical_turns;
    }

    /// The current that flows is not due to the load: the loops begin without it.
    pub fn forget_current(&mut self) {
        self.cascade.reset(0.0);
        self.setpoint_a = 0.0;
    }

    /// Takes the angle anew from the Hall sensors, as at power-on.
    pub fn realign(&mut self, model: &ServoModel, hall: u8, count: u16) {
        self.commutation = Commutation::new(&model.commutation, hall, count);
    }

    /// Velocity and currents of the shaft: every supervision period.
    pub fn measure(&mut self, model: &ServoModel, gains: &ServoGains, phase_current_a: [f32; 2]) {
        let dt_s = model.supervision_period_s;
        let sign = f32::from(model.direction);
        let mut counts_s = self.observer.velocity() / model.control_period_s;
        if gains.tracking_share > 0.0 {
            let tracked = self.tracking.update(&gains.tracking, self.observer.position(), dt_s);
            counts_s += gains.tracking_share * (tracked - counts_s);
        }
        let velocity_rad_s = sign * counts_s * model.rad_per_count();
        self.velocity_rad_s = self.velocity_filter.update(&gains.velocity_filter, velocity_rad_s);
        // A power stage that follows by itself has said its currents.
        if model.fidelity == Fidelity::Full {
            let (sin, cos) = sin_cos_turns(self.electrical_turns);
            let Dq { d, q } = park(clarke(three_phases(phase_current_a)), sin, cos);
            self.current_a = Dq { d, q: sign * q };
        }
    }

    /// The outer loops: every supervision period. `position` is the actual position that the demand counts in.
    pub fn control(
        &mut self,
        model: &ServoModel,
        gains: &ServoGains,
        demand: &Demand,
        position: i32,
        limits: &ServoLimits,
    ) {
        let dt_s = model.supervision_period_s;
        let rad = model.rad_per_count();
        let velocity = self.velocity_rad_s;
        let current_a = match demand {
            Demand::Off => {
                self.release();
                return;
            }
            Demand::Position(point) => {
                let error_counts = point.position.wrapping_sub(position) as f32 + point.fraction as f32;
                let demand = PositionDemand {
                    error_rad: error_counts * rad,
                    velocity_rad_s: point.velocity as f32 * rad,
                    acceleration_rad_s2: self.smooth_acceleration(gains, point.acceleration as f32 * rad),
                };
                self.cascade.position(&gains.cascade, &demand, velocity, limits.current_a, dt_s)
            }
            Demand::Velocity(point) => {
                let demand = VelocityDemand {
                    velocity_rad_s: point.velocity as f32 * rad,
                    acceleration_rad_s2: self.smooth_acceleration(gains, point.acceleration as f32 * rad),
                };
                self.cascade.velocity(&gains.cascade, &demand, velocity, limits.current_a, dt_s)
            }
            Demand::Torque(current_a) => {
                // The velocity loop's own stiffness holds the speed: it may take torque away, and brake.
                let stiffness = gains.cascade.velocity.proportional;
                let most = stiffness * (limits.velocity_rad_s - velocity);
                let least = stiffness * (-limits.velocity_rad_s - velocity);
                let current_a = symmetric(current_a.clamp(least.min(most), most), limits.current_a);
                // The velocity loop takes over here without a step.
                self.cascade.reset(current_a);
                current_a
            }
        };
        let current_a = if self.torque_offset_a == 0.0 {
            current_a
        } else {
            symmetric(current_a + self.torque_offset_a, limits.current_a)
        };
        self.setpoint_a = if current_a.is_finite() { current_a } else { 0.0 };
    }

    /// A current that is known to be needed besides what the loops find out, A (CiA 402-2, object 60B2h).
    pub const fn set_torque_offset(&mut self, current_a: f32) {
        self.torque_offset_a = current_a;
    }

    /// The current loop: every control period. Duty cycles of U, V, W.
    // Inlined by force: with every kind of motor in one program it has several callers, and none would get it.
    #[inline(always)]
    pub fn modulate(
        &mut self,
        model: &ServoModel,
        gains: &ServoGains,
        phase_current_a: [f32; 2],
        bus_v: f32,
    ) -> [f32; 3] {
        let sign = f32::from(model.direction);
        let torque_a = self.torque_filter.update(&gains.torque_filter, self.setpoint_a);
        let setpoint_a = Dq { d: self.direct_setpoint_a, q: sign * torque_a };
        let input = FocInput {
            phase_current_a: three_phases(phase_current_a),
            electrical_turns: self.electrical_turns,
            electrical_rad_s: sign * self.velocity_rad_s * model.commutation.pole_pairs as f32,
            bus_v,
        };
        let output = self.foc.tick(&gains.foc, setpoint_a, &input, model.control_period_s);
        self.saturated = output.saturated;
        self.wanted_v = output.wanted_v;
        output.duty
    }

    /// What a power stage is asked for that follows by itself: every supervision period.
    #[cold]
    #[inline(never)]
    pub fn current_demand(&mut self, model: &ServoModel, gains: &ServoGains) -> CurrentDemand {
        let torque_a = self.torque_filter.update(&gains.torque_filter, self.setpoint_a);
        let setpoint_a = Dq { d: self.direct_setpoint_a, q: f32::from(model.direction) * torque_a };
        CurrentDemand { setpoint_a, electrical_turns: self.electrical_turns }
    }

    /// Counts since power-on, wrapping.
    pub fn position(&self, model: &ServoModel) -> i32 {
        self.observer.position().wrapping_mul(i32::from(model.direction))
    }

    /// Filtered velocity of the shaft, rad/s.
    pub const fn velocity_rad_s(&self) -> f32 {
        self.velocity_rad_s
    }

    /// The same in r/min.
    pub const fn velocity_rpm(&self) -> f32 {
        self.velocity_rad_s * cia402::RPM_PER_RAD_S as f32
    }

    /// Measured torque-producing current, A.
    pub const fn current_a(&self) -> f32 {
        self.current_a.q
    }

    /// Amplitude of the whole measured current, A.
    pub fn current_magnitude_a(&self) -> f32 {
        magnitude(self.current_a)
    }

    /// Amplitude of the phase voltage that the current loops asked for last, V: more than the bus has while it is used up.
    pub fn wanted_magnitude_v(&self) -> f32 {
        magnitude(self.wanted_v)
    }

    /// Asks for a current along the magnets, A: negative weakens the field. It stays until it is asked for anew.
    pub const fn set_direct_current(&mut self, direct_a: f32) {
        self.direct_setpoint_a = direct_a;
    }

    /// Current set-point, A.
    pub const fn setpoint_a(&self) -> f32 {
        self.setpoint_a
    }

    /// The bus voltage is used up.
    pub const fn is_saturated(&self) -> bool {
        self.saturated
    }

    /// How far encoder and Hall sensors were apart at the last Hall edge, in electrical turns.
    pub fn disagreement_turns(&self) -> f32 {
        self.commutation.disagreement_turns()
    }

    fn smooth_acceleration(&mut self, gains: &ServoGains, acceleration: f32) -> f32 {
        self.feed_forward_filter.update(&gains.feed_forward_filter, acceleration)
    }

    /// The power stage is off: the loops begin anew when it comes back.
    fn release(&mut self) {
        self.foc.reset();
        self.cascade.reset(0.0);
        self.feed_forward_filter.value = 0.0;
        self.torque_filter.value = 0.0;
        self.setpoint_a = 0.0;
        self.direct_setpoint_a = 0.0;
        self.wanted_v = Dq::default();
        self.saturated = false;
    }
}

fn magnitude(vector: Dq) -> f32 {
    libm::sqrtf(vector.d * vector.d + vector.q * vector.q)
}

/// Two phases are measured, and the three add up to nothing.
fn three_phases([u, v]: [f32; 2]) -> [f32; 3] {
    [u, v, -u - v]
}
