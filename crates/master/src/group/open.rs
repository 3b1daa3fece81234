//! Making a group of drives: everything that can be wrong is found before anything moves.

use core::time::Duration;

use canopen::Mux;
use cia402::ModeOfOperation;
use cia402::object::{CONTROLWORD, INTERPOLATION_TIME_INDEX, INTERPOLATION_TIME_PERIOD_VALUE};

use super::axis::GroupAxis;
use super::error::{GroupError, PERIODS};
use super::handle::Group;
use super::limits::AxisLimits;
use super::runner::GroupRunner;
use crate::cyclic::{CyclicDrive, CyclicOptions};
use crate::drive::Drive;
use crate::units::Rpm;

/// The interpolation time period (CiA 402-2, 12.3.4): value, and its power of ten in seconds.
const INTERPOLATION_TIME: [Mux; 2] = [INTERPOLATION_TIME_PERIOD_VALUE, INTERPOLATION_TIME_INDEX];

/// A future axis, and how it is moved.
#[derive(Clone, Debug)]
pub struct AxisSetup {
    /// The drive.
    pub drive: Drive,
    /// The mode in which it takes a set-point each cycle. In modes for positions (cyclic synchronous position, interpolated
    /// position) the drive closes its position loop. In modes for speed (profile velocity, cyclic synchronous velocity) the
    /// group closes one over the bus, for models that take no positions in cycles: their accuracy is that of the mapped
    /// position and of the steps of the target velocity. Such a drive's ramps (6083h, 6084h) are set to follow each cycle, so
    /// that a stop of its own by them is a hard one.
    pub mode: ModeOfOperation,
    /// What it may do.
    pub limits: AxisLimits,
}

impl Group {
    /// Makes a group of these axes and has this master produce SYNC with this period. Each drive gets the mapping of
    /// [`Drive::configure_cyclic`] and, where it has the object, the period as its interpolation time (60C2h). Drives that
    /// already have power are switched off by [`enable`](Group::enable) and on again, all together. Nothing moves.
    ///
    /// # Errors
    /// [`GroupError`], before any drive was written to where the limits are wrong or an axis is taken; else what was written for the
    /// cycles is put back, as at the end of a group.
    pub async fn open(axes: &[AxisSetup], period: Duration, options: CyclicOptions) -> Result<Self, GroupError> {
        let network = axes.first().ok_or(GroupError::NoAxis)?.drive.node().network().clone();
        if !PERIODS.contains(&period) {
            return Err(GroupError::Period { given: period });
        }
        let mut claims = Vec::new();
        for (number, axis) in (1..).zip(axes) {
            let node = axis.drive.node().id();
            axis.limits.check(number).map_err(|error| GroupError::Path { node: Some(node), error })?;
            if !network.is_same_as(axis.drive.node().network()) {
                return Err(GroupError::OtherNetwork { node });
            }
            let controlword = axis.drive.place(CONTROLWORD);
            claims.push(network.claim(node, controlword).ok_or(GroupError::Taken { node, controlword })?);
        }
        let mut opened = Vec::new();
        for ((number, setup), claim) in (1..).zip(axes).zip(claims) {
            match setup.open(number, period, options).await {
                Ok(drive) => opened.push(GroupAxis::new(drive, claim)),
                Err(error) => {
                    // No group is left that would do it at its end. The first error is the one to report.
                    let _ = network.put_back(axes.iter().map(|axis| axis.drive.node().id()).collect()).await;
                    return Err(error);
                }
            }
        }
        network.sync(Some(period));
        let limits = axes.iter().map(|axis| axis.limits.clone()).collect();
        let drives = axes.iter().map(|axis| axis.drive.clone()).collect();
        Ok(Self { network, drives, runner: GroupRunner::new(opened, limits, period.as_secs_f64()) })
    }
}

impl AxisSetup {
    /// Modes in which an axis takes a set-point each cycle, the best first: positions, then speeds with the position loop in the
    /// master.
    pub const MODES: [ModeOfOperation; 4] = [
        ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION,
        ModeOfOperation::INTERPOLATED_POSITION,
        ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY,
        ModeOfOperation::PROFILE_VELOCITY,
    ];

    /// The best mode of a drive for an axis of a group: the first that it has of csp, ip, csv and pv.
    ///
    /// # Errors
    /// [`GroupError::NoMode`].
    pub fn best_mode(drive: &Drive) -> Result<ModeOfOperation, GroupError> {
        let modes = drive.axis_description().map(|axis| axis.modes);
        let best = Self::MODES.into_iter().find(|mode| modes.is_some_and(|modes| modes.contains(mode)));
        best.ok_or_else(|| GroupError::NoMode { node: drive.node().id() })
    }

    async fn open(&self, axis: usize, period: Duration, options: CyclicOptions) -> Result<CyclicDrive, GroupError> {
        let (node, mode) = (self.drive.node().id(), self.mode);
        self.drive.configure_cyclic_for_a_motion(mode).await?;
        self.set_interpolation_time(period).await?;
        let drive = self.drive.cyclic(mode, options).await?;
        let stated_rpm = self.limits.velocity_turns_s * 60.0;
        match drive.highest_speed() {
            Some((Rpm(most_rpm), bound)) if stated_rpm > most_rpm * (1.0 + 1e-9) => {
                Err(GroupError::BeyondDrive { axis, node, stated_rpm, most_rpm, bound })
            }
            Some(_) if drive.shows_position_in_cycles() => {
                if drive.set_point().is_none() {
                    let rpm_per_s = self.limits.acceleration_turns_s2 * 60.0;
                    self.drive.write_ramps_of_a_cycle(period, rpm_per_s).await?;
                }
                Ok(drive)
            }
            _ => Err(GroupError::NoPosition { axis, node, mode }),
        }
    }

    /// How far apart the set-points come, for drives that interpolate between them. What they had is put back with the ramps.
    async fn set_interpolation_time(&self, period: Duration) -> Result<(), GroupError> {
        let Some(description) = self.drive.description() else { return Ok(()) };
        let [units, exponent] = INTERPOLATION_TIME.map(|mux| self.drive.place(mux));
        if description.row(units).is_none() || description.row(exponent).is_none() {
            return Ok(());
        }
        // Milliseconds where they are whole; the value has 8 bits.
        let micros = period.as_micros();
        let (value, power) = if micros.is_multiple_of(1000) { (micros / 1000, -3_i8) } else { (micros / 100, -4) };
        let value = u8::try_from(value).map_err(|_| GroupError::Period { given: period })?;
        let node = self.drive.node();
        for object in [units, exponent] {
            node.network().note_former(node.id(), object, node.upload(object).await?);
        }
        node.write(units, value).await?;
        node.write(exponent, power).await?;
        Ok(())
    }
}
