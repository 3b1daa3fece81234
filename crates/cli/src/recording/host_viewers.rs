//! What a host sees of its bus, for viewers: frames, what it reads of the drives, and news.

use std::cell::RefCell;
use std::convert::Infallible;
use std::time::Duration;

use can::{BusFrame, Instant};
use foxglove::Server;
use host::{DriveView, HostHandle, News, Snapshot};
use recording::{Batch, Column, Mark, Severity};
use tokio::sync::broadcast::error::RecvError;

/// How often what has come is handed to the viewers.
const HANDED_ON: Duration = Duration::from_millis(50);

/// Frames between two of these times at most: a bus of 1 Mbit/s carries some 1,000.
const MOST_FRAMES: usize = 8_000;

/// Signals of a drive, by the names of a record, as far as a host reads them.
const SIGNALS: [&str; 6] = ["velocity_rpm", "output_angle_rad", "current_a", "supply_v", "motor_c", "driver_c"];

/// Viewers of a host; without a server it does nothing.
pub(crate) struct HostViewers(Option<RefCell<Shown>>);

struct Shown {
    server: Server,
    /// The drives that have a channel, and when the last values of each were read, s.
    drives: Vec<(u8, f64)>,
    batch: Batch,
}

impl HostViewers {
    pub(crate) fn new(server: Option<Server>) -> Self {
        Self(server.map(|server| RefCell::new(Shown { server, drives: Vec::new(), batch: Batch::default() })))
    }

    /// Notes a frame on its way to the host.
    pub(crate) fn note(&self, passed: Option<BusFrame>) -> Option<BusFrame> {
        if let (Some(shown), Some(passed)) = (&self.0, &passed) {
            let mut shown = shown.borrow_mut();
            if shown.server.is_watched() && shown.batch.frames.len() < MOST_FRAMES {
                shown.batch.frames.push((passed.at, passed.frame));
            }
        }
        passed
    }

    /// Hands on what comes, as long as it is awaited.
    pub(crate) fn serve(&self, host: &HostHandle) -> impl Future<Output = Infallible> + use<'_> {
        // Receivers only: a handle would keep the host alive.
        let (states, mut news) = (host.states(), host.news());
        async move {
            let Some(shown) = &self.0 else { return std::future::pending().await };
            let mut interval = tokio::time::interval(HANDED_ON);
            let mut is_over = false;
            loop {
                tokio::select! {
                    _ = interval.tick() => {
                        let state = states.borrow().snapshot();
                        shown.borrow_mut().hand_on(&state);
                    }
                    came = news.recv(), if !is_over => match came {
                        Ok(news) => shown.borrow_mut().batch.marks.push(mark(news)),
                        Err(RecvError::Lagged(_)) => {}
                        Err(RecvError::Closed) => is_over = true,
                    },
                }
            }
        }
    }
}

impl Shown {
    fn hand_on(&mut self, state: &Snapshot) {
        let drives = state.nodes.iter().filter_map(|node| Some((node.node, node.drive.as_deref()?)));
        for (node, drive) in drives {
            let known = self.drives.iter().position(|(known, _)| *known == node);
            let Some(place) = known.or_else(|| self.add(node)) else { continue };
            let width = self.drives.len() * SIGNALS.len();
            let read_at = &mut self.drives[place].1;
            // The same look is shown more than once.
            if drive.at_s > *read_at {
                *read_at = drive.at_s;
                let mut row = vec![f64::NAN; width];
                row[place * SIGNALS.len()..][..SIGNALS.len()].copy_from_slice(&values(drive));
                self.batch.rows.push((instant(drive.at_s), row));
            }
        }
        self.batch.rows.sort_by_key(|(at, _)| *at);
        let batch = std::mem::take(&mut self.batch);
        self.server.show(batch);
    }

    /// A channel for a drive that was not there before; its place, unless it has to wait.
    fn add(&mut self, node: u8) -> Option<usize> {
        let names = SIGNALS.iter().map(|signal| format!("{node}.{signal}"));
        let columns: Vec<Column> = names.filter_map(|name| name.parse().ok()).collect();
        self.server.add(&columns).then(|| {
            self.drives.push((node, f64::NEG_INFINITY));
            self.drives.len() - 1
        })
    }
}

/// In the order of [`SIGNALS`]; not a number where the drive has none.
fn values(drive: &DriveView) -> [f64; SIGNALS.len()] {
    let DriveView { velocity_rpm, angle_degrees, current_a, supply_v, motor_celsius, driver_celsius, .. } = drive;
    let output_angle_rad = angle_degrees.map(f64::to_radians);
    [*velocity_rpm, output_angle_rad, *current_a, *supply_v, *motor_celsius, *driver_celsius]
        .map(|value| value.unwrap_or(f64::NAN))
}

fn mark(News { time_s, node, text }: News) -> Mark {
    let of = node.map_or_else(String::new, |node| format!("node {node}"));
    Mark { at: instant(time_s), of: of.into(), kind: "".into(), severity: Severity::Note, text }
}

fn instant(seconds: f64) -> Instant {
    Instant::ZERO + Duration::try_from_secs_f64(seconds).unwrap_or_default()
}
