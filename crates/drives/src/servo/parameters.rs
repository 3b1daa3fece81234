//! The objects of one axis in increments and amperes, as the engine wants them. Written anew when one changes.

use canopen::object::COMMUNICATION_CYCLE_PERIOD;
use canopen::od::{Dictionary, Slot, Storage};
use cia402::{
    AbortConnectionOption, DisableOperationOption, FaultReactionOption, HaltOption, HomingMethod, InterpolationPeriod,
    InterpolationSubMode, ModeOfOperation, QuickStopOption, ShutdownOption, StopRamp, Window,
};
use motion::jerk::JerkRamp;
use motion::set_points::{Following, Interpolation};
use motion::travel::{Bounds, Travel};

use super::motor::Motor;
use super::position_range::PositionRange;
use super::read;
use super::scales::Scales;
use super::slots::AxisSlots;
use super::velocity_mode::VelocityMode;
use crate::engine::axis::{Control, HomingParameters, MoveLimits, Ramp, VelocityRamps};
use crate::engine::cia402::{self as power, DisableOptions, ExternalStop, ModeChange, Tolerances};

/// Periods of the bus that a cyclic set-point may stay away before the motion is brought to rest.
pub(super) const FORGIVEN_PERIODS: f64 = 2.0;
/// How long velocities and torques by RPDO may stay away where nothing says how often they come. Guess: ten periods of
/// 10 ms, a slow cycle.
pub(super) const PATIENCE_S: f64 = 0.1;
/// Deceleration of a device without any: that of the motor's rated torque on its own inertia would be rough; this stops
/// from the highest speed in a fifth of a second.
const STOPS_IN_S: f64 = 0.2;
/// Windows in increments of a device that has no object for them.
const POSITION_WINDOW: i64 = 100;
const WINDOW_TIME_MS: i64 = 10;
/// Speeds and torques that count as reached without an object, share of the highest speed and of the rated torque.
const VELOCITY_WINDOW_SHARE: f64 = 0.005;
const STANDSTILL_SHARE: f64 = 0.001;
const TORQUE_WINDOW_SHARE: f32 = 0.05;

/// 6086h.
const JERK_LIMITED: i64 = 3;
/// A jerk that does not limit, increments/s³: a thousand times what stops any motor within a control period.
const ANY_JERK: f64 = 1e15;

/// A rate that does not limit, increments/s²: finite for the planner.
const ANY_RATE: f64 = 1e12;

/// A position that does not limit, increments: finite, so that its product with 0 is a number.
const FAR: f64 = 1e18;

/// Everything that an axis reads of the dictionary besides its targets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parameters {
    pub(super) scales: Scales,
    /// [`VELOCITY`](ModeOfOperation::VELOCITY) or any other.
    pub(super) mode: ModeOfOperation,
    pub(super) velocity_mode: VelocityMode,
    pub(super) power: power::Parameters,
    /// Position window 6067h, increments, and its time.
    pub(super) position_window: Window,
    /// Velocity window 606Dh, increments/s, and its time.
    pub(super) velocity_window: (f64, u16),
    /// Velocity threshold 606Fh, increments/s, and its time.
    pub(super) velocity_threshold: (f64, u16),
    /// Following error window 6065h, increments, and its time.
    pub(super) following_error: Window,
    /// How set-points of ip and csp are followed.
    pub(super) following: Following,
    /// How long velocities and torques by RPDO may stay away that come in another rhythm.
    pub(super) set_point_patience_s: f64,
    pub(super) travel: Option<Travel>,
    /// 607Bh, while no software limit keeps the shaft from going round in it.
    pub(super) range: Option<PositionRange>,
    pub(super) bounds: Bounds,
    /// 607Fh and 6080h, increments/s.
    pub(super) max_speed: f64,
    /// Torque at which 6071h is 1000, N m.
    pub(super) rated_torque_nm: f32,
    /// Largest currents towards larger and smaller positions, A.
    pub(super) max_current_a: [f32; 2],
    pub(super) home_offset: i32,
    pub(super) abort_connection: AbortConnectionOption,
    pub(super) fault_reaction: FaultReactionOption,
}

/// Reads the objects of one axis.
struct Reader<'a, S: Storage> {
    values: &'a Dictionary<S>,
    slots: &'a AxisSlots,
    scales: Scales,
    motor: &'a Motor,
}

impl Parameters {
    /// As they act in a mode: velocity mode has ramps of its own.
    pub(super) fn of(
        values: &Dictionary<impl Storage>,
        slots: &AxisSlots,
        motor: &Motor,
        mode: ModeOfOperation,
    ) -> Self {
        let scales = Scales::of(values, slots, motor.increments_per_turn);
        let parameters = Reader { values, slots, scales, motor }.parameters();
        if mode == ModeOfOperation::VELOCITY { parameters.in_velocity_mode() } else { parameters }
    }

    /// With the ramps of velocity mode where it has them.
    fn in_velocity_mode(mut self) -> Self {
        let VelocityMode { acceleration, deceleration, quick_stop, .. } = self.velocity_mode;
        // A rate that is not finite is the motor's own; 0 would be a step.
        let within = |rate: Option<f64>, bound: f64, own: Ramp| match rate.map(|rate| rate.min(bound)) {
            Some(rate) if rate > 0.0 => Ramp::Rate(if rate.is_finite() { rate } else { ANY_RATE }),
            _ => own.without_jerk(),
        };
        let power = &mut self.power;
        power.velocity.acceleration = within(acceleration, self.bounds.acceleration, power.velocity.acceleration);
        power.velocity.deceleration = within(deceleration, self.bounds.deceleration, power.velocity.deceleration);
        power.moves.deceleration = power.velocity.deceleration;
        power.quick_stop_ramp = within(quick_stop, f64::INFINITY, power.quick_stop_ramp);
        self.following.deceleration = power.moves.deceleration.rate(self.max_speed);
        self.mode = ModeOfOperation::VELOCITY;
        self
    }

    /// A torque in thousandths of the rated one as a current, A.
    pub(super) fn current_a(&self, per_mille: i64, motor: &Motor) -> f32 {
        per_mille as f32 * 1e-3 * self.rated_torque_nm / motor.torque_constant_nm_a()
    }

    /// A current as a torque in thousandths of the rated one.
    pub(super) fn torque(&self, current_a: f32, motor: &Motor) -> i64 {
        libm::roundf(current_a * motor.torque_constant_nm_a() / self.rated_torque_nm * 1e3) as i64
    }
}

impl<S: Storage> Reader<'_, S> {
    fn parameters(&self) -> Parameters {
        let slots = self.slots;
        let max_speed = self.max_speed();
        let bounds = self.bounds(max_speed);
        let rated_torque_nm = match self.read(slots.rated_torque, 0) {
            millis @ 1.. => millis as f32 * 1e-3,
            _ => self.motor.rated_torque_nm,
        };
        let deceleration = self.rate(slots.deceleration, bounds.deceleration);
        let travel = self.travel();
        Parameters {
            scales: self.scales,
            mode: ModeOfOperation::NONE,
            velocity_mode: VelocityMode::of(self.values, slots, &self.scales),
            power: self.power(&bounds, rated_torque_nm),
            position_window: Window {
                half_width: self.window(slots.position_window, POSITION_WINDOW),
                time_ms: self.time_ms(slots.position_window_time, WINDOW_TIME_MS),
            },
            velocity_window: (
                self.speed(slots.velocity_window, VELOCITY_WINDOW_SHARE * self.fastest()),
                self.time_ms(slots.velocity_window_time, WINDOW_TIME_MS),
            ),
            velocity_threshold: (
                self.speed(slots.velocity_threshold, STANDSTILL_SHARE * self.fastest()),
                self.time_ms(slots.velocity_threshold_time, WINDOW_TIME_MS),
            ),
            following_error: Window {
                // 0 would forbid every motion: a file that leaves it at 0 leaves it open.
                half_width: match self.window(slots.following_error_window, i64::from(Window::OFF)) {
                    0 => Window::OFF,
                    width => width,
                },
                time_ms: self.time_ms(slots.following_error_time, 0),
            },
            following: self.following(deceleration),
            set_point_patience_s: self.set_point_patience_s(),
            travel,
            range: self.range().filter(|_| travel.is_none()),
            bounds,
            max_speed,
            rated_torque_nm,
            max_current_a: self.max_current_a(rated_torque_nm),
            home_offset: counter(self.scales.increments(self.read(slots.home_offset, 0))),
            abort_connection: AbortConnectionOption(self.read(slots.abort_connection, 1) as i16),
            fault_reaction: self.fault_reaction(),
        }
    }

    fn power(&self, bounds: &Bounds, rated_torque_nm: f32) -> power::Parameters {
        let slots = self.slots;
        let profile_speed = match slots.profile_velocity {
            Some(_) => self.scales.speed(self.read(slots.profile_velocity, 0)).min(bounds.speed),
            None => bounds.speed,
        };
        let acceleration = self.rate(slots.acceleration, bounds.acceleration).min(bounds.acceleration);
        let deceleration = self.rate(slots.deceleration, bounds.deceleration).min(bounds.deceleration);
        let [acceleration, deceleration] = self.ramps(acceleration, deceleration);
        let end_speed = self.scales.speed(self.magnitude(slots.end_velocity)).min(profile_speed);
        let ramps = VelocityRamps { start_speed: 0.0, max_speed: bounds.speed, acceleration, deceleration };
        let per_mille_a = rated_torque_nm * 1e-3 / self.motor.torque_constant_nm_a();
        power::Parameters {
            moves: MoveLimits {
                start_speed: 0.0,
                max_speed: profile_speed,
                end_speed,
                passes: end_speed > 0.0,
                acceleration,
                deceleration,
            },
            velocity: ramps,
            quick_stop_ramp: Ramp::Rate(self.rate(slots.quick_stop_deceleration, self.default_rate())),
            torque_slope_a_s: self.read(slots.torque_slope, 0) as f32 * per_mille_a,
            quick_stop: QuickStopOption(self.read(slots.quick_stop, 2) as i16),
            disable: DisableOptions {
                shutdown: ShutdownOption(self.read(slots.shutdown, 0) as i16),
                disable_operation: DisableOperationOption(self.read(slots.disable_operation, 1) as i16),
            },
            halt: HaltOption(self.read(slots.halt, 1) as i16),
            emergency_stop: StopRamp::CurrentLimit,
            limit_stop: Some(StopRamp::QuickStop),
            homing: self.homing(bounds),
            external_stop: ExternalStop::Hold,
            tolerances: Tolerances {
                position: self.window(slots.position_window, POSITION_WINDOW),
                velocity: self.speed(slots.velocity_window, VELOCITY_WINDOW_SHARE * self.fastest()),
                current_a: TORQUE_WINDOW_SHARE * self.motor.rated_current_a,
            },
            mode_change: ModeChange::Turning,
        }
    }

    /// Straight, or by 6086h = 3 with the jerks of 60A4h as 60A3h names them (CiA 402-2, 60A3h: 1 for all, 2 for either ramp,
    /// 4 for either end of either ramp). A jerk of 0 does not limit.
    fn ramps(&self, acceleration: f64, deceleration: f64) -> [Ramp; 2] {
        let slots = self.slots;
        let type_of_ramps = self.read(slots.motion_profile_type, 0);
        let jerks = [slots.jerk_1, slots.jerk_2, slots.jerk_3, slots.jerk_4];
        if type_of_ramps != JERK_LIMITED || slots.jerk_1.is_none() {
            return [Ramp::Rate(acceleration), Ramp::Rate(deceleration)];
        }
        let places = match self.read(slots.jerk_use, 1) {
            2 => [0, 0, 1, 1],
            4 => [0, 1, 2, 3],
            _ => [0; 4],
        };
        let [up_begin, up_end, down_begin, down_end] = places.map(|place: usize| match self.magnitude(jerks[place]) {
            0 => ANY_JERK,
            jerk => self.scales.rate(jerk),
        });
        let ramp = |rate, begin, end| Ramp::Jerk(JerkRamp { rate, begin, end });
        [ramp(acceleration, up_begin, up_end), ramp(deceleration, down_begin, down_end)]
    }

    fn homing(&self, bounds: &Bounds) -> HomingParameters {
        let slots = self.slots;
        let slow = self.fastest() * 0.01;
        let rate = Ramp::Rate(self.rate(slots.homing_acceleration, self.default_rate()));
        HomingParameters {
            sequence: HomingMethod(self.read(slots.homing_method, 0) as i8).sequence(),
            search_speed: self.speed(slots.homing_speed_switch, 5.0 * slow).min(bounds.speed),
            latch_speed: self.speed(slots.homing_speed_zero, slow).min(bounds.speed),
            ramps: VelocityRamps { start_speed: 0.0, max_speed: bounds.speed, acceleration: rate, deceleration: rate },
            end: rate,
            back_off: 0,
            single_pass: false,
            control: Control::Position,
        }
    }

    /// 60C2h, and linear unless 60C0h says otherwise.
    fn following(&self, deceleration: f64) -> Following {
        let slots = self.slots;
        let period = InterpolationPeriod {
            value: self.read(slots.interpolation_period_value, 1) as u8,
            index: self.read(slots.interpolation_period_index, -3) as i8,
        };
        let sub_mode = InterpolationSubMode(self.read(slots.interpolation_sub_mode, 0) as i16);
        Following {
            interpolation: if sub_mode == InterpolationSubMode::CUBIC {
                Interpolation::Cubic
            } else {
                Interpolation::Linear
            },
            period_s: period.nanos().unwrap_or_default() as f64 * 1e-9,
            forgiven: FORGIVEN_PERIODS,
            deceleration,
        }
    }

    /// Three periods of SYNC where 1006h says how long one is, in us (CiA 301, 7.5.2.6).
    fn set_point_patience_s(&self) -> f64 {
        match self.values.view().value(COMMUNICATION_CYCLE_PERIOD) {
            Ok(period_us @ 1..) => (1.0 + FORGIVEN_PERIODS) * period_us as f64 * 1e-6,
            _ => PATIENCE_S,
        }
    }

    /// 607Dh in increments, which may be beyond what the counter holds: then nothing reaches the limit. The wrong way round it
    /// is off, as most makers have it, and so is an end of the type's range, which some write as -7FFFFFFFh.
    fn travel(&self) -> Option<Travel> {
        let (low, high) = (self.slots.min_position?, self.slots.max_position?);
        let [low, high] = [low, high].map(|slot| self.read(Some(slot), 0));
        let no_limit = |limit: i64| limit.abs() >= i64::from(i32::MAX);
        if low >= high || (no_limit(low) && no_limit(high)) {
            return None;
        }
        let turned_over = self.scales.position_direction();
        let [a, b] = [low, high].map(|limit| match limit {
            _ if no_limit(limit) => FAR.copysign((limit * turned_over) as f64),
            _ => self.scales.increments(limit) as f64,
        });
        // Units that are finer than increments may leave both ends on one of them: limits all the same.
        Travel::new(a.min(b), a.max(b).max(a.min(b) + 0.5))
    }

    /// 607Bh: after its greatest position comes its least. The wrong way round it is off, and with all that 32 bits hold, too.
    fn range(&self) -> Option<PositionRange> {
        let (low, high) = (self.slots.min_position_range?, self.slots.max_position_range?);
        let [low, high] = [low, high].map(|slot| self.read(Some(slot), 0));
        let is_all = low <= i64::from(i32::MIN) && high >= i64::from(i32::MAX);
        (low < high && !is_all).then(|| PositionRange::new(low, high, &self.scales))
    }

    fn bounds(&self, speed: f64) -> Bounds {
        let most = |slot| match self.magnitude(slot) {
            0 => f64::INFINITY,
            rate => self.scales.rate(rate),
        };
        Bounds {
            speed,
            acceleration: most(self.slots.max_acceleration),
            deceleration: most(self.slots.max_deceleration),
        }
    }

    /// A speed, rate or limit, which the standard has unsigned. A file may give it a signed type: its sign says nothing.
    fn magnitude(&self, slot: Option<Slot>) -> i64 {
        self.read(slot, 0).saturating_abs()
    }

    /// The least of what 607Fh, 6080h and the motor allow.
    fn max_speed(&self) -> f64 {
        let profile = match self.magnitude(self.slots.max_profile_velocity) {
            0 => f64::INFINITY,
            speed => self.scales.speed(speed),
        };
        let motor = match self.magnitude(self.slots.max_motor_speed) {
            0 => f64::INFINITY,
            rpm => self.scales.motor_speed(rpm),
        };
        profile.min(motor).min(self.fastest())
    }

    /// The motor's own highest speed, increments/s.
    fn fastest(&self) -> f64 {
        f64::from(self.motor.max_velocity_rad_s) / core::f64::consts::TAU * f64::from(self.motor.increments_per_turn)
    }

    /// The least of 6072h, 6073h, 60E0h and 60E1h, and what the power stage bears.
    fn max_current_a(&self, rated_torque_nm: f32) -> [f32; 2] {
        let slots = self.slots;
        let kt = self.motor.torque_constant_nm_a();
        let torque_a = |slot: Option<Slot>| match slot {
            Some(_) => self.magnitude(slot) as f32 * 1e-3 * rated_torque_nm / kt,
            None => f32::INFINITY,
        };
        let rated_a = match self.read(slots.rated_current, 0) {
            millis @ 1.. => millis as f32 * 1e-3 * core::f32::consts::SQRT_2,
            _ => self.motor.rated_current_a,
        };
        let current_a = match self.magnitude(slots.max_current) {
            0 => f32::INFINITY,
            per_mille => per_mille as f32 * 1e-3 * rated_a,
        };
        let most_a = self.motor.max_current_a.min(current_a).min(torque_a(slots.max_torque));
        [slots.positive_torque_limit, slots.negative_torque_limit].map(|slot| most_a.min(torque_a(slot)))
    }

    /// Codes that mean nothing to this firmware count as the standard's default.
    fn fault_reaction(&self) -> FaultReactionOption {
        let code = FaultReactionOption(self.read(self.slots.fault_reaction, 2) as i16);
        if code.ramp().is_some() { code } else { FaultReactionOption::QUICK_STOP }
    }

    /// A rate of an object; without the object, or with 0 in it, the default or `most` if that is less.
    fn rate(&self, slot: Option<Slot>, most: f64) -> f64 {
        match self.magnitude(slot) {
            0 => self.default_rate().min(most),
            rate => self.scales.rate(rate),
        }
    }

    fn default_rate(&self) -> f64 {
        self.fastest() / STOPS_IN_S
    }

    fn speed(&self, slot: Option<Slot>, absent: f64) -> f64 {
        match slot {
            Some(_) => self.scales.speed(self.magnitude(slot)),
            None => absent,
        }
    }

    fn window(&self, slot: Option<Slot>, absent: i64) -> u32 {
        match self.read(slot, absent) as u32 {
            Window::OFF => Window::OFF,
            width => self.scales.length(width),
        }
    }

    fn time_ms(&self, slot: Option<Slot>, absent: i64) -> u16 {
        self.read(slot, absent) as u16
    }

    fn read(&self, slot: Option<Slot>, absent: i64) -> i64 {
        read(self.values, slot, absent)
    }
}

/// A position as the counter has it, which is as wide as the encoder's own: beyond its ends it is held there.
pub(super) fn counter(increments: i64) -> i32 {
    increments.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
}
