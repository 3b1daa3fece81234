//! What a machine file has of the axes that move as one: its groups and its base, so that a program need not type them again.

use std::time::Duration;

use machine::file::{BASE_PERIOD, BasePlan, GROUP_PERIOD, GroupPlan, Machine, speed_mode};
use master::base::WheelSetup;
use master::group::AxisSetup;
use pyo3::prelude::*;
use words::failure::Failure;

use super::Network;
use crate::failure::raised;

impl Network {
    fn file(&self, py: Python<'_>, what: &str) -> PyResult<&Machine> {
        let none = || {
            let failure = Failure::usage(format!("{what} is taken from a machine file, and this network has none"));
            raised(py, &failure.next("give it one: Network(bus, machine=FILE), or World.machine(FILE)"))
        };
        self.machine.as_deref().ok_or_else(none)
    }

    /// The axes of a group of the machine file, and its period.
    pub(super) fn group_of_file(&self, py: Python<'_>, name: &str) -> PyResult<(Vec<AxisSetup>, Duration)> {
        let machine = self.file(py, &format!("group {name:?}"))?;
        let names = || machine.groups.iter().map(|group| group.name.as_str()).collect::<Vec<_>>().join(", ");
        let group = machine.groups.iter().find(|group| group.name == name).ok_or_else(|| {
            let failure = Failure::usage(format!("the machine file has no group {name:?}"));
            raised(
                py,
                &failure.next(format!("its groups: {}", if names().is_empty() { "none".into() } else { names() })),
            )
        })?;
        let axes = self.axes_of(machine, group).map_err(|failure| raised(py, &failure))?;
        Ok((axes, group.period.unwrap_or(GROUP_PERIOD)))
    }

    fn axes_of(&self, machine: &Machine, group: &GroupPlan) -> Result<Vec<AxisSetup>, Failure> {
        let axes = group.axes.iter().map(|axis| {
            let drive = machine.drive(self.core.node(axis.node));
            let best =
                || AxisSetup::best_mode(&drive).map_err(|error| Failure::new(error.to_string()).at_node(axis.node));
            let mode = axis.mode.map_or_else(best, Ok)?;
            Ok(AxisSetup { drive, mode, limits: axis.limits.clone() })
        });
        axes.collect()
    }

    /// The wheels of the base of the machine file, what else it has of it, and its period.
    pub(super) fn base_of_file(&self, py: Python<'_>) -> PyResult<([WheelSetup; 2], BasePlan, Duration)> {
        let machine = self.file(py, "the base")?;
        let plan = machine.base.ok_or_else(|| {
            let failure = Failure::usage("the machine file has no [base]");
            raised(py, &failure.next("docs/machine-file.md has what a base needs"))
        })?;
        let wheel = |(node, turns)| {
            let drive = machine.drive(self.core.node(node));
            let mode = plan.mode.unwrap_or_else(|| speed_mode(&drive));
            WheelSetup { drive, mode, turns }
        };
        Ok((plan.wheels.map(wheel), plan, plan.period.unwrap_or(BASE_PERIOD)))
    }
}
