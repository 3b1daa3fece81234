//! Velocity from an incremental encoder.
//!
//! Counts per period alone are useless at low speed: at 1 r/min a 4096-count encoder gives one count in 15 ms. This
//! observer takes way over time between *edges* (the M/T method): whenever counts have arrived, the way since an
//! edge at least half a window ago, over the periods in between. At high speed that is a sliding mean over the
//! window; at low speed it is the time of a single count. Between edges the estimate is bounded by what the silence
//! allows, one count over the time since the last edge, so that it falls as the motor comes to rest.
//!
//! Resolution: the time of an edge is known to one period, so the relative error is at most one period over the span
//! (50 us over 1 ms to 2 ms and more: 5 % at worst, unfiltered). Delay: half the span. A low-pass follows in
//! the caller where the loop wants it smoother.

/// How the observer is set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObserverGains {
    /// Longest span that velocity is taken over while edges are plentiful, in periods.
    pub window: u32,
    /// After so many periods without an edge the velocity reads zero.
    pub standstill: u32,
}

impl ObserverGains {
    /// A window and a standstill time at a period.
    pub fn new(window_s: f32, standstill_s: f32, dt_s: f32) -> Self {
        let periods = |time_s: f32| ((time_s / dt_s + 0.5) as u32).max(2);
        ObserverGains { window: periods(window_s), standstill: periods(standstill_s) }
    }
}

/// An edge: where the disc stood and when.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Edge {
    boundary: i32,
    period: u32,
}

/// State of the observer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observer {
    register: u16,
    position: i32,
    period: u32,
    older: Edge,
    newer: Edge,
    last: Edge,
    /// Counts per period.
    velocity: f32,
}

impl Observer {
    /// An observer at rest, for an encoder whose hardware counter reads `count`.
    pub fn new(count: u16) -> Self {
        Observer {
            register: count,
            position: 0,
            period: 0,
            older: Edge::default(),
            newer: Edge::default(),
            last: Edge::default(),
            velocity: 0.0,
        }
    }

    /// Takes in the hardware counter, once each period, and returns the velocity in counts per period.
    ///
    /// The encoder must move by less than 32768 counts in a period.
    #[inline]
    pub fn update(&mut self, gains: &ObserverGains, count: u16) -> f32 {
        let moved = count.wrapping_sub(self.register) as i16;
        self.register = count;
        // A silence beyond that of a standstill says nothing more: the clock stops until the next edge.
        self.period = self.period.wrapping_add(u32::from(self.silence() < gains.standstill));
        if moved == 0 {
            self.wait(gains);
        } else {
            self.position = self.position.wrapping_add(i32::from(moved));
            // The edge crossed last: the lower end of this count going up, the upper end going down.
            let boundary = self.position.wrapping_add(i32::from(moved < 0));
            self.cross(gains, Edge { boundary, period: self.period });
        }
        self.velocity
    }

    /// The same once in a period as long as many, of a shaft whose mean velocity over that period is known, in counts per period:
    /// what the edges would tell of it. The mean over spans of half a window to a window comes late by half of three quarters of
    /// a window; a mean over one period by half a period, and a first-order lag brings the rest. Less than one count in the time
    /// of a standstill counts as zero speed.
    pub fn follow(&mut self, gains: &ObserverGains, count: u16, velocity: f32) {
        let moved = count.wrapping_sub(self.register) as i16;
        self.register = count;
        self.position = self.position.wrapping_add(i32::from(moved));
        self.period = self.period.wrapping_add(u32::from(self.silence() < gains.standstill));
        let rested = self.silence() >= gains.standstill;
        if moved == 0 && (rested || self.velocity == 0.0) {
            // Nothing is known before the second edge.
            self.velocity = 0.0;
            return;
        }
        if rested && moved.unsigned_abs() < 2 {
            self.velocity = 0.0;
        } else {
            let lag = (gains.window as f32 * (3.0 / 8.0) - 0.5).max(0.0);
            let from = if self.velocity == 0.0 { velocity } else { self.velocity };
            self.velocity = from + (velocity - from) / (1.0 + lag);
        }
        if moved == 0 {
            let bound = 1.0 / self.silence().max(1) as f32;
            self.velocity = self.velocity.clamp(-bound, bound);
        } else {
            self.last = Edge { boundary: self.position, period: self.period };
        }
    }

    /// Counts per period.
    #[inline]
    pub fn velocity(&self) -> f32 {
        self.velocity
    }

    /// Counts since the observer began, wrapping.
    #[inline]
    pub fn position(&self) -> i32 {
        self.position
    }

    /// Periods since the last edge.
    #[inline]
    fn silence(&self) -> u32 {
        self.period.wrapping_sub(self.last.period)
    }

    #[inline]
    fn cross(&mut self, gains: &ObserverGains, edge: Edge) {
        if self.silence() >= gains.standstill {
            // From rest: nothing is known but this edge.
            (self.older, self.newer) = (edge, edge);
            self.velocity = 0.0;
        } else {
            self.velocity = way_over_time(self.older, edge);
            // Keep a span between half a window and a window.
            if edge.period.wrapping_sub(self.newer.period) >= gains.window / 2 {
                (self.older, self.newer) = (self.newer, edge);
            }
        }
        self.last = edge;
    }

    #[inline]
    fn wait(&mut self, gains: &ObserverGains) {
        if self.velocity == 0.0 {
            return;
        }
        let silence = self.silence();
        if silence >= gains.standstill {
            self.velocity = 0.0;
            return;
        }
        let bound = 1.0 / silence as f32;
        self.velocity = self.velocity.clamp(-bound, bound);
    }
}

#[inline]
fn way_over_time(from: Edge, to: Edge) -> f32 {
    let way = to.boundary.wrapping_sub(from.boundary);
    let time = to.period.wrapping_sub(from.period).max(1);
    way as f32 / time as f32
}
