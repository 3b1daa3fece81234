//! Homing, mode 6, methods 17 to 22 ("M Robot Joint Motor CanOpen Manual", 5.09; CiA 402-2, clause 11), with switches on
//! PU and DIR.
//!
//! Every method looks for one edge of its switch while moving in one direction. If the switch does not stand before
//! that edge, the motor first moves the other way until it does. One speed serves all moves. A switch that never comes
//! is looked for up to the mechanical stop, where an alarm ends homing.

/// Which pin the switch is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Switch {
    /// PU: the positive limit.
    Pu,
    /// DIR: the negative limit, or the origin switch.
    Dir,
}

/// One homing method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Method {
    /// Value of 6098h.
    pub number: i8,
    /// Its switch.
    pub switch: Switch,
    /// The origin is where the switch goes on (true) or off (false) ...
    pub rising: bool,
    /// ... while moving in this direction, 1 or -1.
    pub direction: i8,
}

/// All methods. The manual has pictures of 17, 18, 19 and 21; 20 and 22 are as CiA 402 pairs them.
#[rustfmt::skip]
pub static METHODS: [Method; 6] = [
    Method { number: 17, switch: Switch::Dir, rising: false, direction:  1 },
    Method { number: 18, switch: Switch::Pu,  rising: false, direction: -1 },
    Method { number: 19, switch: Switch::Dir, rising: false, direction: -1 },
    Method { number: 20, switch: Switch::Dir, rising: true,  direction:  1 },
    Method { number: 21, switch: Switch::Dir, rising: false, direction:  1 },
    Method { number: 22, switch: Switch::Dir, rising: true,  direction: -1 },
];

/// The method of a value of 6098h.
pub fn method(number: i8) -> Option<&'static Method> {
    METHODS.iter().find(|method| method.number == number)
}

/// A homing run: which way to go, until its edge has come.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    method: &'static Method,
    /// Present direction.
    direction: i8,
    level: bool,
}

impl Run {
    /// Begins, with the levels of PU and DIR.
    pub fn new(method: &'static Method, pu: bool, dir: bool) -> Self {
        let level = method.level(pu, dir);
        let stands_before_the_edge = level != method.rising;
        let direction = if stands_before_the_edge { method.direction } else { -method.direction };
        Self { method, direction, level }
    }

    /// Takes in the levels while the shaft is told to move in the direction `moving` (0 while it rests). True at the
    /// edge that is the origin.
    ///
    /// An edge that is passed the wrong way, as by a motor that slows down beyond a short switch, turns the run around.
    pub fn update(&mut self, pu: bool, dir: bool, moving: i8) -> bool {
        let level = self.method.level(pu, dir);
        if level == self.level {
            return false;
        }
        self.level = level;
        let is_edge = level == self.method.rising;
        if is_edge && moving == self.method.direction && self.direction == moving {
            return true;
        }
        if !is_edge {
            self.direction = self.method.direction;
        }
        false
    }

    /// The direction to move in, 1 or -1.
    pub const fn direction(&self) -> i8 {
        self.direction
    }
}

impl Method {
    const fn level(&self, pu: bool, dir: bool) -> bool {
        match self.switch {
            Switch::Pu => pu,
            Switch::Dir => dir,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Walks one count at a time with a switch in `on`, overshooting each turn by `overshoot` counts.
    fn walk(number: i8, from: i32, on: core::ops::Range<i32>, overshoot: i32) -> Option<i32> {
        let method = method(number)?;
        let level = |at: i32| on.contains(&at);
        let both = |at: i32| if method.switch == Switch::Pu { (level(at), false) } else { (false, level(at)) };
        let (pu, dir) = both(from);
        let mut run = Run::new(method, pu, dir);
        let (mut at, mut moving, mut coast) = (from, run.direction(), 0);
        for _ in 0..100_000 {
            if run.direction() != moving {
                coast += 1;
                if coast > overshoot {
                    (moving, coast) = (run.direction(), 0);
                }
            }
            at += i32::from(moving);
            let (pu, dir) = both(at);
            if run.update(pu, dir, moving) {
                return Some(at);
            }
        }
        None
    }

    #[test]
    fn each_method_finds_its_edge_from_either_side_and_from_the_switch() {
        // Limit switches reach to the end; origin switches too, on the side that the method expects.
        let negative = -10_000..-100;
        let positive = 100..10_000;
        for overshoot in [0, 37] {
            for (number, switch, off, on, edge) in [
                (17, &negative, 0, -500, -100),
                (18, &positive, 0, 500, 99),
                (19, &positive, 0, 500, 99),
                (20, &positive, 0, 500, 100),
                (21, &negative, 0, -500, -100),
                (22, &negative, 0, -500, -101),
            ] {
                assert_eq!(walk(number, off, switch.clone(), overshoot), Some(edge), "{number} from off the switch");
                assert_eq!(walk(number, on, switch.clone(), overshoot), Some(edge), "{number} from on the switch");
            }
        }
    }

    #[test]
    fn a_short_switch_that_is_overrun_is_found_on_the_way_back() {
        assert_eq!(walk(17, 0, -110..-100, 50), Some(-100));
        assert_eq!(walk(21, 0, -110..-100, 50), Some(-100));
    }

    #[test]
    fn a_short_switch_that_lies_behind_is_never_found() {
        for (number, behind) in [(17, 100..200), (18, -200..-100), (19, -200..-100), (20, -200..-100), (21, 100..200)] {
            assert_eq!(walk(number, 0, behind, 0), None, "{number}");
        }
    }
}
