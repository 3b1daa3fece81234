//! A planned motion: up to four stretches of changing or constant velocity, or some of constant jerk, evaluated at any time.
//!
//! [`scurve`](crate::scurve), [`trapezoid`](crate::trapezoid) and [`jerk`](crate::jerk) plan; the first two use the move solver here,
//! because the two shapes cover the same distance: either way the mean velocity of a change is the mean of its two ends.
//! Position unit: the caller's (counts, turns, radians); `f64` resolves 2^31 counts to 5e-7 of a count.

/// Where a motion is at one time.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Point {
    /// Position relative to where the motion was planned from.
    pub position: f64,
    /// Units per second.
    pub velocity: f64,
    /// Units per second squared.
    pub acceleration: f64,
}

/// How velocity runs from one value to another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shape {
    /// Constant acceleration.
    Linear,
    /// Two joined parabolas: acceleration rises to twice its mean in the middle and falls again.
    Parabolic,
}

/// One stretch: velocity from `from` to `to` in `duration_s`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Stretch {
    duration_s: f64,
    from: f64,
    to: f64,
}

const MAX_STRETCHES: usize = 4;

/// One stretch of constant jerk.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Jerk {
    pub(crate) duration_s: f64,
    /// Units per second cubed.
    pub(crate) jerk: f64,
}

/// To rest: an acceleration that falls, and three; then to the peak three, the plateau, and to the end three.
pub(crate) const MAX_JERKS: usize = 11;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Segments {
    Stretches(Shape, [Stretch; MAX_STRETCHES]),
    Jerks(Point, [Jerk; MAX_JERKS]),
}

/// A planned motion. Before its start it rests at zero, after its end at [`Profile::end`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Profile {
    segments: Segments,
    end: Point,
    duration_s: f64,
}

impl Profile {
    fn new(shape: Shape) -> Self {
        let segments = Segments::Stretches(shape, Default::default());
        Profile { segments, end: Point::default(), duration_s: 0.0 }
    }

    /// Stretches of constant jerk from `start`, which come to `end`.
    pub(crate) fn of_jerks(start: Point, jerks: [Jerk; MAX_JERKS], end: Point) -> Self {
        let duration_s = jerks.iter().map(|jerk| jerk.duration_s).sum();
        Profile { segments: Segments::Jerks(start, jerks), end, duration_s }
    }

    /// Time from start to end.
    pub fn duration(&self) -> f64 {
        self.duration_s
    }

    /// Where the motion comes to, from then on: for a move its distance at velocity zero, for a velocity change the
    /// target velocity (the position then keeps growing with it).
    pub fn end(&self) -> Point {
        self.end
    }

    /// The same motion, which goes on past its end with the velocity that it arrives with, at most `velocity` (signed).
    ///
    /// A plan that turns round on its way arrives from the other side, and comes to rest.
    #[must_use]
    pub fn ending_at(mut self, velocity: f64) -> Self {
        let arrival = self.at(self.duration_s * (1.0 - 1e-12)).velocity;
        let goes_on = self.duration_s > 0.0 && arrival * velocity > 0.0;
        self.end.velocity = if goes_on { arrival.abs().min(velocity.abs()).copysign(velocity) } else { 0.0 };
        self
    }

    /// The point at a time after the start.
    pub fn at(&self, time_s: f64) -> Point {
        if time_s >= self.duration_s {
            let position = self.end.position + self.end.velocity * (time_s - self.duration_s);
            return Point { position, ..self.end };
        }
        let mut time_s = time_s.max(0.0);
        match &self.segments {
            Segments::Stretches(shape, stretches) => {
                let mut position = 0.0;
                for stretch in stretches {
                    if time_s < stretch.duration_s {
                        return stretch.at(*shape, time_s).moved_by(position);
                    }
                    time_s -= stretch.duration_s;
                    position += stretch.distance();
                }
            }
            Segments::Jerks(start, jerks) => {
                let mut from = *start;
                for jerk in jerks {
                    if time_s < jerk.duration_s {
                        return jerk.at(from, time_s);
                    }
                    time_s -= jerk.duration_s;
                    from = jerk.at(from, jerk.duration_s);
                }
            }
        }
        self.end
    }

    /// Joins one more stretch; one without duration leaves only its step of velocity.
    fn push(&mut self, index: usize, duration_s: f64, from: f64, to: f64) {
        if let Segments::Stretches(_, stretches) = &mut self.segments {
            stretches[index] = Stretch { duration_s, from, to };
            self.duration_s += duration_s;
        }
    }

    fn travelled(&self) -> f64 {
        match &self.segments {
            Segments::Stretches(_, stretches) => stretches.iter().map(Stretch::distance).sum(),
            Segments::Jerks(..) => self.end.position,
        }
    }
}

impl Point {
    fn moved_by(self, distance: f64) -> Point {
        Point { position: self.position + distance, ..self }
    }
}

impl Jerk {
    /// The point `time_s` after `from`.
    pub(crate) fn at(self, from: Point, time_s: f64) -> Point {
        let Point { position, velocity, acceleration } = from;
        let (t, jerk) = (time_s, self.jerk);
        Point {
            position: position + t * (velocity + t * (0.5 * acceleration + t * jerk / 6.0)),
            velocity: velocity + t * (acceleration + 0.5 * t * jerk),
            acceleration: acceleration + t * jerk,
        }
    }
}

impl Stretch {
    fn distance(&self) -> f64 {
        0.5 * (self.from + self.to) * self.duration_s
    }

    /// The point `time_s` into the stretch; `time_s < duration_s`, so the duration is not zero.
    fn at(&self, shape: Shape, time_s: f64) -> Point {
        let change = self.to - self.from;
        let x = time_s / self.duration_s;
        // Share of the change reached, its integral over x and its derivative.
        let (share, integral, slope) = match shape {
            Shape::Linear => (x, 0.5 * x * x, 1.0),
            Shape::Parabolic if x < 0.5 => (2.0 * x * x, 2.0 / 3.0 * x * x * x, 4.0 * x),
            Shape::Parabolic => {
                let y = 1.0 - x;
                // By symmetry about the middle; the integral up to 1 is 1/2.
                (1.0 - 2.0 * y * y, 0.5 - y + 2.0 / 3.0 * y * y * y, 4.0 * y)
            }
        };
        Point {
            position: self.from * time_s + change * integral * self.duration_s,
            velocity: self.from + change * share,
            acceleration: change * slope / self.duration_s,
        }
    }
}

/// Inputs beyond this are held to it: far above any drive, far below where squares overflow.
const LARGEST: f64 = 1e15;
/// A time beyond this is held to it: thirty years.
const LONGEST_S: f64 = 1e9;
/// Speeds closer than this share of the larger one count as equal.
const SAME_SPEED: f64 = 1e-9;

/// A speed under this counts as none: a count in thirty years.
const SLOWEST: f64 = 1e-9;

/// A speed limit a planner can work with: finite, not negative.
pub(crate) fn sane_speed(speed: f64) -> f64 {
    let speed = sane(speed).abs();
    if speed < SLOWEST { 0.0 } else { speed }
}

/// A value a planner can work with: not a number becomes zero, the huge becomes [`LARGEST`].
pub(crate) fn sane(value: f64) -> f64 {
    if value.is_nan() { 0.0 } else { value.clamp(-LARGEST, LARGEST) }
}

/// A duration a planner can work with: negative and not a number become zero.
pub(crate) fn sane_time(time_s: f64) -> f64 {
    if time_s.is_nan() { 0.0 } else { time_s.clamp(0.0, LONGEST_S) }
}

/// One change of velocity.
pub(crate) fn velocity_change(shape: Shape, from: f64, to: f64, duration_s: f64) -> Profile {
    let mut profile = Profile::new(shape);
    profile.push(0, duration_s, from, to);
    profile.end = Point { position: profile.travelled(), velocity: to, acceleration: 0.0 };
    profile
}

/// How long a change of speed takes.
#[derive(Debug, Clone, Copy)]
pub(crate) enum SpeedChange {
    /// Seconds per unit of speed; zero is a step.
    Pace(f64),
    /// Seconds for the change to the plateau from wherever it starts.
    Time(f64),
}

impl SpeedChange {
    /// Seconds per unit of speed on the way to the plateau.
    fn pace(self, start: f64, max_speed: f64) -> f64 {
        match self {
            SpeedChange::Pace(pace) => pace,
            SpeedChange::Time(time_s) => pace(time_s, start, max_speed).unwrap_or(0.0),
        }
    }
}

/// What a move has to keep to, in units and seconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MoveLimits {
    /// The motion begins with a step to this speed, unless it is already faster.
    pub(crate) start_speed: f64,
    /// Speed of the plateau.
    pub(crate) max_speed: f64,
    /// The motion ends with a step from this speed to rest.
    pub(crate) end_speed: f64,
    /// How it speeds up.
    pub(crate) acceleration: SpeedChange,
    /// Seconds per unit of speed while slowing down to the end; zero is a step.
    pub(crate) deceleration_pace: f64,
    /// Seconds per unit of speed while stopping a motion that cannot end at the target.
    pub(crate) stopping_pace: f64,
}

/// A move over `distance` from velocity `velocity`.
///
/// A motion away from the target, or too fast to end there, is first brought to rest and the rest of the way is
/// planned from there, so that the end is exact and no pace is exceeded.
pub(crate) fn position_move(shape: Shape, distance: f64, velocity: f64, limits: MoveLimits) -> Profile {
    let mut profile = Profile::new(shape);
    let direction = if distance == 0.0 { 1_f64.copysign(velocity) } else { 1_f64.copysign(distance) };
    let approach = velocity * direction;
    let stopping = 0.5 * approach * approach * limits.stopping_pace;
    let too_fast =
        approach > limits.end_speed && stopping_distance(approach, &limits) > distance.abs() + tolerance(distance);
    if velocity != 0.0 && (approach < 0.0 || too_fast) {
        profile.push(0, approach.abs() * limits.stopping_pace, velocity, 0.0);
        let left = distance - stopping.copysign(velocity);
        plan_towards(&mut profile, left, 0.0, &limits);
    } else {
        plan_towards(&mut profile, distance, approach.max(0.0), &limits);
    }
    profile.end =
        Point { position: if limits.max_speed > 0.0 { distance } else { profile.travelled() }, ..Point::default() };
    profile
}

/// Rounding of a distance that a caller has computed: a move planned in mid-deceleration is not too fast for it.
fn tolerance(distance: f64) -> f64 {
    distance.abs() * 1e-9
}

/// Way from `speed` down to the end speed.
fn stopping_distance(speed: f64, limits: &MoveLimits) -> f64 {
    let end = limits.end_speed.min(speed);
    0.5 * (speed * speed - end * end) * limits.deceleration_pace
}

/// Speed up, run, slow down: the last three stretches. `speed` is the present one, towards the target.
fn plan_towards(profile: &mut Profile, distance: f64, speed: f64, limits: &MoveLimits) {
    let MoveLimits { max_speed, deceleration_pace: down, .. } = *limits;
    let length = distance.abs();
    if length == 0.0 || max_speed <= 0.0 {
        return;
    }
    let sign = 1_f64.copysign(distance);
    let end = limits.end_speed.min(max_speed);
    let mut start = speed.max(limits.start_speed.min(max_speed));
    if speed <= limits.start_speed && stopping_distance(start, limits) > length {
        // Too short to slow down from the start speed: start slower.
        start = libm::sqrt(end * end + 2.0 * length / down);
    }
    if start > max_speed {
        slow_to_plateau(profile, sign, length, start, end, limits);
        return;
    }
    let up = limits.acceleration.pace(start, max_speed);
    // length = (peak^2 - start^2) up / 2 + (peak^2 - end^2) down / 2, solved for the peak.
    let room = 2.0 * length + start * start * up + end * end * down;
    let peak = if room >= max_speed * max_speed * (up + down) { max_speed } else { libm::sqrt(room / (up + down)) };
    // Too short to reach the end speed: only speed up, and end slower.
    let peak = if peak < end && up > 0.0 { libm::sqrt(start * start + 2.0 * length / up) } else { peak.max(start) };
    let end = end.min(peak);
    let ramps = 0.5 * ((peak * peak - start * start) * up + (peak * peak - end * end) * down);
    let plateau_s = if peak > 0.0 { ((length - ramps) / peak).max(0.0) } else { 0.0 };
    profile.push(1, (peak - start) * up, sign * start, sign * peak);
    profile.push(2, plateau_s, sign * peak, sign * peak);
    profile.push(3, (peak - end) * down, sign * peak, sign * end);
}

/// Already faster than the plateau: slow down to it, run, slow down to the end.
fn slow_to_plateau(profile: &mut Profile, sign: f64, length: f64, start: f64, end: f64, limits: &MoveLimits) {
    let MoveLimits { max_speed, deceleration_pace: down, .. } = *limits;
    let ramps = 0.5 * (start * start - end * end) * down;
    let plateau_s = ((length - ramps) / max_speed).max(0.0);
    profile.push(1, (start - max_speed) * down, sign * start, sign * max_speed);
    profile.push(2, plateau_s, sign * max_speed, sign * max_speed);
    profile.push(3, (max_speed - end) * down, sign * max_speed, sign * end);
}

/// Pace of a change between two speeds in a time; equal speeds have none.
pub(crate) fn pace(time_s: f64, from: f64, to: f64) -> Option<f64> {
    let change = (to - from).abs();
    (change > SAME_SPEED * from.abs().max(to.abs())).then(|| time_s / change)
}
