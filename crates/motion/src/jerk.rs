//! Profiles of limited jerk: acceleration rises and falls along straight lines (CiA 402-2, motion profile type 3, with the profile
//! jerk 60A4h; IEC 61800-7-201 has the same).
//!
//! A change of velocity is up to three stretches: the acceleration rises with one jerk, stays at its limit, and falls with
//! another. A move is a change to its peak, a plateau and a change to its end. The peak of a move that is too short for its full speed
//! has no closed form for unlike ramps: it is found by halving, once when the move is planned. A motion that has an acceleration
//! already, because it is planned anew on the way, goes on from it without a step.

use crate::profile::{Jerk, MAX_JERKS, Point, Profile, sane, sane_speed};
use crate::trapezoid;

/// How a velocity changes: units/s² and units/s³. Without one of the jerks the ramp is straight, without a rate a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct JerkRamp {
    /// Highest acceleration.
    pub rate: f64,
    /// Jerk at the beginning, while the acceleration rises.
    pub begin: f64,
    /// Jerk at the end, while it falls.
    pub end: f64,
}

/// Change of velocity from `from` to `to` (units/s), that begins with an acceleration (units/s²).
pub fn velocity_change(from: f64, acceleration: f64, to: f64, ramp: &JerkRamp) -> Profile {
    if !ramp.is_limited() {
        return trapezoid::velocity_change(from, to, ramp.rate);
    }
    let mut plan = JerkPlan::from(sane(from), sane(acceleration));
    plan.change_to(sane(to), ramp, ramp);
    plan.profile(None)
}

/// A move from one position to another.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PositionMove {
    /// Signed way to go, in units.
    pub distance: f64,
    /// Present velocity, units/s, signed.
    pub velocity: f64,
    /// Present acceleration, units/s², signed.
    pub acceleration: f64,
    /// Speed of the plateau, units/s. With zero the motion only comes to rest, short of its distance.
    pub max_speed: f64,
    /// Speed that the motion ends from, units/s.
    pub end_speed: f64,
    /// How it speeds up.
    pub up: JerkRamp,
    /// How it slows down.
    pub down: JerkRamp,
}

/// Rates and jerks beyond these count as none: what is planned with them stays finite, and shorter than years.
const SMALLEST: f64 = 1e-3;
const LARGEST: f64 = 1e15;

/// Halvings of the range of peaks: as many as a double has digits.
const HALVINGS: u32 = 60;

impl PositionMove {
    /// Plans the move. Any input gives a finite plan, as of [`trapezoid::PositionMove::plan`](crate::trapezoid::PositionMove::plan).
    /// A motion away from the target, or too fast to end there, is first brought to rest.
    pub fn plan(&self) -> Profile {
        if !(self.up.is_limited() && self.down.is_limited()) {
            return self.straight();
        }
        let distance = sane(self.distance);
        let (max_speed, end_speed) =
            (sane_speed(self.max_speed), sane_speed(self.end_speed).min(sane_speed(self.max_speed)));
        let mut plan = JerkPlan::from(sane(self.velocity), sane(self.acceleration));
        if distance == 0.0 && plan.is_at_rest() {
            return plan.profile(Some(Point::default()));
        }
        if max_speed == 0.0 {
            plan.change_to(0.0, &self.up, &self.down);
            return plan.profile(None);
        }
        let sign = 1_f64.copysign(distance);
        if !self.fits(&plan, sign, distance.abs(), end_speed) {
            plan.change_to(0.0, &self.up, &self.down);
        }
        let left = distance - plan.position;
        if left != 0.0 {
            self.go(&mut plan, left, max_speed, end_speed);
        }
        plan.profile(Some(Point { position: distance, velocity: 0.0, acceleration: 0.0 }))
    }

    fn straight(&self) -> Profile {
        trapezoid::PositionMove {
            distance: self.distance,
            velocity: self.velocity,
            start_speed: 0.0,
            max_speed: self.max_speed,
            end_speed: self.end_speed,
            acceleration: self.up.rate,
            deceleration: self.down.rate,
        }
        .plan()
    }

    /// Whether the motion can end at the target without turning round.
    fn fits(&self, from: &JerkPlan, sign: f64, length: f64, end_speed: f64) -> bool {
        let relaxed = relaxed_velocity(from, &self.up, &self.down) * sign;
        let slowest = if relaxed > end_speed { end_speed } else { relaxed };
        let way = self.way(from, sign, slowest, end_speed);
        from.velocity * sign >= 0.0 && relaxed >= 0.0 && way <= length * (1.0 + 1e-9)
    }

    /// The way to a peak and on to the end.
    fn way(&self, from: &JerkPlan, sign: f64, peak: f64, end_speed: f64) -> f64 {
        let mut plan = *from;
        self.over_peak(&mut plan, sign, peak, 0.0, end_speed);
        (plan.position - from.position) * sign
    }

    fn over_peak(&self, plan: &mut JerkPlan, sign: f64, peak: f64, plateau_s: f64, end_speed: f64) {
        plan.change_to(sign * peak, &self.up, &self.down);
        plan.push(plateau_s, 0.0);
        plan.change_to(sign * end_speed.min(peak), &self.up, &self.down);
    }

    /// Speed up, run, slow down, in the direction of what is left.
    fn go(&self, plan: &mut JerkPlan, left: f64, max_speed: f64, end_speed: f64) {
        let (sign, length) = (1_f64.copysign(left), left.abs());
        let full = self.way(plan, sign, max_speed, end_speed);
        if full <= length {
            return self.over_peak(plan, sign, max_speed, (length - full) / max_speed, end_speed);
        }
        let relaxed = (relaxed_velocity(plan, &self.up, &self.down) * sign).max(0.0);
        let (mut low, mut high) = (if relaxed > end_speed { end_speed } else { relaxed }, max_speed);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if self.way(plan, sign, middle, end_speed) <= length { low = middle } else { high = middle }
        }
        self.over_peak(plan, sign, low, 0.0, end_speed);
    }
}

/// The velocity after the present acceleration has fallen to none.
fn relaxed_velocity(from: &JerkPlan, up: &JerkRamp, down: &JerkRamp) -> f64 {
    let mut plan = *from;
    plan.relax(up, down);
    plan.velocity
}

/// Stretches of constant jerk so far, and where they end.
#[derive(Clone, Copy)]
struct JerkPlan {
    jerks: [Jerk; MAX_JERKS],
    count: usize,
    start: Point,
    position: f64,
    velocity: f64,
    acceleration: f64,
}

impl JerkPlan {
    fn from(velocity: f64, acceleration: f64) -> Self {
        Self {
            jerks: [Jerk::default(); MAX_JERKS],
            count: 0,
            start: Point { position: 0.0, velocity, acceleration },
            position: 0.0,
            velocity,
            acceleration,
        }
    }

    fn is_at_rest(&self) -> bool {
        self.velocity == 0.0 && self.acceleration == 0.0
    }

    fn profile(&self, end: Option<Point>) -> Profile {
        let reached = Point { position: self.position, velocity: self.velocity, acceleration: 0.0 };
        Profile::of_jerks(self.start, self.jerks, end.unwrap_or(reached))
    }

    fn push(&mut self, duration_s: f64, jerk: f64) {
        if duration_s.is_nan() || duration_s <= 0.0 || self.count == MAX_JERKS {
            return;
        }
        let stretch = Jerk { duration_s, jerk };
        let end = stretch.at(
            Point { position: self.position, velocity: self.velocity, acceleration: self.acceleration },
            duration_s,
        );
        self.jerks[self.count] = stretch;
        self.count += 1;
        (self.position, self.velocity, self.acceleration) = (end.position, end.velocity, end.acceleration);
    }

    /// The acceleration falls to none, by the jerk that ends the ramp that it is of.
    fn relax(&mut self, up: &JerkRamp, down: &JerkRamp) {
        let speeds_up = self.acceleration * self.velocity >= 0.0;
        let ramp = if speeds_up { up } else { down };
        self.lower_acceleration(0.0, ramp);
    }

    /// The size of the acceleration falls to `to`.
    fn lower_acceleration(&mut self, to: f64, ramp: &JerkRamp) {
        let (before, sign) = (self.acceleration.abs(), 1_f64.copysign(self.acceleration));
        if before > to {
            self.push((before - to) / ramp.end, -sign * ramp.end);
            self.acceleration = sign * to;
        }
    }

    /// To another velocity, without an acceleration at its end.
    fn change_to(&mut self, to: f64, up: &JerkRamp, down: &JerkRamp) {
        let mut relaxed = *self;
        relaxed.relax(up, down);
        let missing = to - relaxed.velocity;
        let ramp = if to.abs() > relaxed.velocity.abs() { up } else { down };
        if missing == 0.0 {
            *self = relaxed;
            self.velocity = to;
            return;
        }
        let sign = 1_f64.copysign(missing);
        if self.acceleration * sign < 0.0 {
            *self = relaxed;
        } else {
            self.lower_acceleration(ramp.rate, ramp);
        }
        let (from, change) = (self.acceleration * sign, (to - self.velocity) * sign);
        let paces = 0.5 / ramp.begin + 0.5 / ramp.end;
        let highest = libm::sqrt(((change + 0.5 * from * from / ramp.begin) / paces).max(0.0));
        let peak = highest.min(ramp.rate).max(from);
        let ends = 0.5 * (peak * peak - from * from) / ramp.begin + 0.5 * peak * peak / ramp.end;
        let level_s = if highest > ramp.rate && peak > 0.0 { (change - ends) / peak } else { 0.0 };
        self.push((peak - from) / ramp.begin, sign * ramp.begin);
        self.push(level_s, 0.0);
        self.push(peak / ramp.end, -sign * ramp.end);
        (self.velocity, self.acceleration) = (to, 0.0);
    }
}

impl JerkRamp {
    /// Its jerk has a limit that a plan can keep to.
    fn is_limited(&self) -> bool {
        [self.rate, self.begin, self.end].iter().all(|part| (SMALLEST..=LARGEST).contains(part))
    }
}
