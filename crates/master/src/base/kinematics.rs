//! Two wheels on one axle: from the motion of the base to the speeds of its wheels, and back (differential drive). Siegwart,
//! Nourbakhsh and Scaramuzza, "Introduction to Autonomous Mobile Robots", 2nd edition, 3.2 and 5.2.4.

use core::f64::consts::TAU;

use super::limits::{BaseError, BaseLimits};

/// How a base moves: along its heading, and about the middle of its axle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Twist {
    /// Along the heading, m/s.
    pub linear_m_s: f64,
    /// About the vertical axis, rad/s; to the left is positive.
    pub angular_rad_s: f64,
}

/// Where a base is: the middle of its axle, from where it was begun to be counted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Along the x axis, m.
    pub x_m: f64,
    /// Along the y axis, m.
    pub y_m: f64,
    /// Direction from the x axis towards the y axis, rad; many turns.
    pub heading_rad: f64,
}

/// The base's dimensions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// Distance of the points where the wheels touch the ground, m.
    pub wheel_base_m: f64,
    /// Rolling radius of the wheels, m.
    pub wheel_radius_m: f64,
}

/// The speeds of the two wheels forward, or the ways that they went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wheels {
    /// Left.
    pub left: f64,
    /// Right.
    pub right: f64,
}

impl Geometry {
    /// That both are lengths.
    ///
    /// # Errors
    /// [`BaseError::BadLength`].
    pub fn check(&self) -> Result<(), BaseError> {
        for (what, value) in [("wheel_base_m", self.wheel_base_m), ("wheel_radius_m", self.wheel_radius_m)] {
            if !value.is_finite() || value <= 0.0 {
                return Err(BaseError::BadLength { what, value });
            }
        }
        Ok(())
    }

    /// Speeds of the wheels over the ground in m/s.
    pub fn wheels_m_s(&self, twist: Twist) -> Wheels {
        let across = 0.5 * twist.angular_rad_s * self.wheel_base_m;
        Wheels { left: twist.linear_m_s - across, right: twist.linear_m_s + across }
    }

    /// The motion of the base that wheels with these speeds over the ground make.
    pub fn twist(&self, wheels_m_s: Wheels) -> Twist {
        let Wheels { left, right } = wheels_m_s;
        Twist { linear_m_s: 0.5 * (left + right), angular_rad_s: (right - left) / self.wheel_base_m }
    }

    /// What a wheel turns in a second at this speed over the ground.
    pub fn turns_per_m(&self) -> f64 {
        1.0 / (TAU * self.wheel_radius_m)
    }

    /// The twist nearest to this one within the limits, on the same circle: both of its parts are made smaller by one share, so
    /// that a base that is asked for too much follows its path more slowly and does not leave it.
    pub fn saturate(&self, twist: Twist, limits: &BaseLimits) -> Twist {
        let Wheels { left, right } = self.wheels_m_s(twist);
        let shares = [
            limits.linear_m_s / twist.linear_m_s.abs(),
            limits.angular_rad_s / twist.angular_rad_s.abs(),
            limits.wheel_m_s / left.abs(),
            limits.wheel_m_s / right.abs(),
        ];
        // What does not move has an infinite share.
        let share = shares.into_iter().fold(1.0, f64::min);
        Twist { linear_m_s: share * twist.linear_m_s, angular_rad_s: share * twist.angular_rad_s }
    }
}

impl Pose {
    /// Where a base comes to whose wheels go these ways over the ground, in m: on an arc of a circle, as wheels with a constant
    /// ratio of speeds go. No approximation for short steps.
    #[must_use]
    pub fn after(self, ways_m: Wheels, geometry: &Geometry) -> Self {
        let Wheels { left, right } = ways_m;
        let (arc, turn) = (0.5 * (left + right), (right - left) / geometry.wheel_base_m);
        let chord = arc * sinc(0.5 * turn);
        let direction = self.heading_rad + 0.5 * turn;
        Self {
            x_m: self.x_m + chord * direction.cos(),
            y_m: self.y_m + chord * direction.sin(),
            heading_rad: self.heading_rad + turn,
        }
    }
}

/// sin(x)/x. Of small angles by its series, whose next term is below the last digit.
fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-4 { 1.0 - x * x / 6.0 } else { x.sin() / x }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::{FRAC_PI_2, PI};

    use super::*;

    const BASE: Geometry = Geometry { wheel_base_m: 0.4, wheel_radius_m: 0.084 };

    fn near(pose: Pose, [x_m, y_m, heading_rad]: [f64; 3]) {
        let off = [pose.x_m - x_m, pose.y_m - y_m, pose.heading_rad - heading_rad];
        assert!(off.iter().all(|off| off.abs() < 1e-12), "{pose:?}");
    }

    #[test]
    fn straight_on_a_spin_and_a_circle_end_where_geometry_says() {
        let start = Pose::default();
        near(start.after(Wheels { left: 2.0, right: 2.0 }, &BASE), [2.0, 0.0, 0.0]);
        // On the spot, a half turn: each wheel goes half a circle of the wheel base.
        near(start.after(Wheels { left: -0.2 * PI, right: 0.2 * PI }, &BASE), [0.0, 0.0, PI]);
        // A quarter of a circle with a radius of 1 m to the left: in one step, whatever its length.
        let quarter = Wheels { left: 0.8 * FRAC_PI_2, right: 1.2 * FRAC_PI_2 };
        near(start.after(quarter, &BASE), [1.0, 1.0, FRAC_PI_2]);
        let whole = (0..4).fold(start, |pose, _| pose.after(quarter, &BASE));
        near(whole, [0.0, 0.0, TAU]);
    }

    #[test]
    fn steps_of_any_length_come_to_the_same_place() {
        let fine =
            (0..1_000_000).fold(Pose::default(), |pose, _| pose.after(Wheels { left: 1e-6, right: 1.000_1e-6 }, &BASE));
        let coarse = Pose::default().after(Wheels { left: 1.0, right: 1.000_1 }, &BASE);
        assert!((fine.x_m - coarse.x_m).abs() < 1e-9 && (fine.y_m - coarse.y_m).abs() < 1e-9);
    }

    #[test]
    fn a_twist_becomes_wheels_and_comes_back() {
        let twist = Twist { linear_m_s: 0.5, angular_rad_s: -1.0 };
        assert_eq!(BASE.wheels_m_s(twist), Wheels { left: 0.7, right: 0.3 });
        let back = BASE.twist(BASE.wheels_m_s(twist));
        assert!((back.linear_m_s - 0.5).abs() < 1e-12 && (back.angular_rad_s + 1.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_too_fast_keeps_its_circle() {
        let limits = BaseLimits { linear_m_s: 1.0, angular_rad_s: 2.0, wheel_m_s: 1.0, ..BaseLimits::of_test() };
        for (linear_m_s, angular_rad_s) in [(3.0, 1.0), (1.0, 1.0), (0.2, 9.0), (-2.0, 0.0), (0.0, 5.0), (0.3, 0.3)] {
            let asked = Twist { linear_m_s, angular_rad_s };
            let kept = BASE.saturate(asked, &limits);
            let wheels = BASE.wheels_m_s(kept);
            assert!(wheels.left.abs().max(wheels.right.abs()) <= 1.0 + 1e-12);
            assert!(kept.linear_m_s.abs() <= 1.0 + 1e-12 && kept.angular_rad_s.abs() <= 2.0 + 1e-12);
            // Cross product of the two: zero for one circle.
            assert!((kept.linear_m_s * angular_rad_s - kept.angular_rad_s * linear_m_s).abs() < 1e-12);
        }
        assert_eq!(BASE.saturate(Twist::default(), &limits), Twist::default());
    }
}
