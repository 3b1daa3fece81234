//! A measurement of a drive, with lower gains where its own make it swing.

use std::time::Duration;

use devices::Loops;
use master::Drive;
use master::cyclic::CyclicOptions;
use words::failure::{Failure, both};

use super::bench::{Bench, Bounds, CURRENT_KIND, Excursion, LATE_KIND, Measurement, excitation};
use super::setup::Setup;

/// How often gains are halved before a speed loop that swings is given up.
const HALVINGS: u32 = 4;

/// Measures a drive in the first of these periods in which no sample is missing.
///
/// # Errors
/// As [`measure`].
pub(super) async fn measure_in_time(
    drive: &Drive,
    setup: &Setup,
    loops: &Loops,
    (periods, bounds, options): (&[Duration], Bounds, CyclicOptions),
    excursion: &mut Excursion,
) -> Result<(Duration, Measurement), Failure> {
    let mut late = None;
    for &period in periods {
        match measure(drive, setup, loops, (period, bounds, options), excursion).await {
            Err(failure) if failure.kind == LATE_KIND => late = Some(failure),
            measured => return measured.map(|measured| (period, measured)),
        }
    }
    Err(late.unwrap_or_else(|| Failure::new("no period is given")))
}

/// Measures a drive; [`Setup::put_back`] undoes what was written for that. Gains with which the speed loop swings by itself are
/// halved meanwhile.
///
/// # Errors
/// What stopped it, and that it was not seen to stand.
pub async fn measure(
    drive: &Drive,
    setup: &Setup,
    loops: &Loops,
    (period, bounds, options): (Duration, Bounds, CyclicOptions),
    excursion: &mut Excursion,
) -> Result<Measurement, Failure> {
    let excitation = excitation(period)?;
    let mut share = 1.0;
    for left in (0..=HALVINGS).rev() {
        setup.prepare(drive, share).await?;
        let mut bench = Bench::open(drive, loops, period, bounds, options, *excursion).await?;
        bench.gain_share = share;
        let measured = match bench.swings().await {
            Ok(false) => bench.measure(&excitation).await.map(Some),
            Ok(true) => Ok(None),
            Err(failure) => Err(failure),
        };
        let measured = match measured {
            // With lower gains the same speeds take less.
            Err(failure) if failure.kind == CURRENT_KIND && left > 0 => Ok(None),
            measured => measured,
        };
        *excursion = bench.excursion;
        if let Some(measurement) = both(measured, bench.stop().await)? {
            return Ok(measurement);
        }
        share *= 0.5;
    }
    let id = drive.node().id();
    Err(Failure::new(format!("node {id}: its speed loop swings by itself, even with a sixteenth of its gains"))
        .at_node(id)
        .next("look for a loose coupling or a wrong number of encoder lines"))
}
