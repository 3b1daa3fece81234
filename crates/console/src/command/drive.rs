//! `ferrodrive state`, `enable`, `disable`, `stop`, `quick-stop` and `reset`: the power state machine of CiA 402 by its
//! intents, and what a drive says of itself.

use canopen::NmtState;
use cia402::{ModeOfOperation, PowerState};
use master::Gear;
use master::drive::{Drive, DriveState};
use serde::Serialize;

use crate::failure::Failure;
use plot::Paint;
use words::node::{Nodes, nodes};

/// Show the state of a drive, or of all: power state, fault, position, speed, current, supply
///
/// Reads only. A fault is shown with its remedy. What a drive has no object for is omitted. `explain` shows why it does
/// not move, `watch` shows objects as they change.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ferrodrive state 4\n  ferrodrive --bus can0 --machine machine.toml state 4 --json"
)]
pub struct State {
    /// Node-ID, or all
    #[arg(value_name = "NODE|all", value_parser = nodes)]
    pub(super) nodes: Nodes,
}

/// Enable a drive, or all: power its motor, which holds still
///
/// Takes the transitions of CiA 402 to operation enabled, whatever state the drive is in; a fault is not reset. The
/// drive stays enabled when the command has ended.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ferrodrive --bus can0 enable 4\n  ferrodrive --bus can0 enable 4 -v      # each frame of it\n  \
                  ferrodrive --bus can0 enable all"
)]
pub struct Enable {
    /// Node-ID, or all
    #[arg(value_name = "NODE|all", value_parser = nodes)]
    pub(super) nodes: Nodes,
}

/// Disable a drive, or all: stop it, then remove power from its motor
///
/// A load that pulls (an arm, a slope) moves a motor without power, unless a brake holds it.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 disable 4\n  ferrodrive --bus can0 disable all")]
pub struct Disable {
    /// Node-ID, or all
    #[arg(value_name = "NODE|all", value_parser = nodes)]
    pub(super) nodes: Nodes,
}

/// Stop a drive, or all, with the deceleration ramp; it stays enabled
///
/// Returns when it stands. In profile torque it is quick-stopped, since without torque it would coast. With all, every drive
/// that answers on the bus is stopped at the same time, and the status is 0 only when each one was seen to stand.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 stop 4\n  ferrodrive --bus can0 stop all")]
pub struct Stop {
    /// Node-ID, or all
    #[arg(value_name = "NODE|all", value_parser = nodes)]
    pub(super) nodes: Nodes,
}

/// Stop a drive, or all, with the quick stop as configured (605Ah)
///
/// Uses the quick stop of the model in every mode, and reports the state of the drive afterwards. `quick-stop all` is
/// `estop`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 quick-stop 4\n  ferrodrive --bus can0 quick-stop all")]
pub struct QuickStop {
    /// Node-ID, or all
    #[arg(value_name = "NODE|all", value_parser = nodes)]
    pub(super) nodes: Nodes,
}

/// Reset the fault of a drive, or of all, once its cause is gone
///
/// A fault that persists is reported with its cause and remedy. The drive is not enabled.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 reset 4\n  ferrodrive --bus can0 reset all\n  \
                  ferrodrive --bus can0 state 4          # the fault, and what to do about it")]
pub struct Reset {
    /// Node-ID, or all
    #[arg(value_name = "NODE|all", value_parser = nodes)]
    pub(super) nodes: Nodes,
}

/// What a drive says of itself.
#[derive(Debug, Serialize)]
pub struct StateReport {
    /// Its node-ID.
    pub node: u8,
    /// The model, if it is known for sure.
    model: Option<&'static str>,
    /// The model that its objects speak for.
    guess: Option<&'static str>,
    state: &'static str,
    /// The mode of operation: its number, and its name where CiA 402 or the model has one.
    mode: Option<i8>,
    mode_name: Option<&'static str>,
    statusword: u16,
    bits: Vec<&'static str>,
    /// Null where the drive refuses to show it.
    fault_code: Option<u16>,
    #[serde(skip)]
    is_faulted: bool,
    #[serde(skip)]
    is_enabled: bool,
    faults: Vec<FaultReport>,
    /// Where its shaft is and what it does.
    #[serde(flatten)]
    pub motion: ShaftMotion,
    supply_v: Option<f64>,
    motor_c: Option<f64>,
    driver_c: Option<f64>,
    nmt_state: Option<String>,
    /// What stands behind the shaft, where something does: angles and speeds are those of its output.
    #[serde(skip_serializing_if = "Option::is_none")]
    gear: Option<GearReport>,
}

/// What stands behind a shaft, as the machine file says.
#[derive(Debug, Serialize)]
struct GearReport {
    ratio: f64,
    feed_constant_mm: Option<f64>,
    #[serde(skip)]
    text: String,
}

/// Where a shaft is and what it does; what is not known is left out of the text.
#[derive(Debug, Serialize)]
pub struct ShaftMotion {
    position: Option<i64>,
    angle_deg: Option<f64>,
    velocity_rpm: Option<f64>,
    current_a: Option<f64>,
    /// The same along the way, behind a gear with a feed.
    #[serde(skip_serializing_if = "Option::is_none")]
    position_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    velocity_mm_s: Option<f64>,
    #[serde(skip)]
    is_geared: bool,
}

#[derive(Debug, Serialize)]
struct FaultReport {
    code: u16,
    name: &'static str,
    remedy: &'static str,
}

impl StateReport {
    /// Reads everything that the drive says of itself.
    pub async fn read(drive: &Drive) -> Result<Self, Failure> {
        let state: DriveState = drive.state().await?;
        let bits = state.statusword_words();
        let gear = drive.gear();
        let mm = |turns: Option<f64>| Some(turns? * gear.feed_m()? * 1e3);
        let faults = state.faults.iter().map(|row| FaultReport { code: row.code, name: row.name, remedy: row.remedy });
        Ok(Self {
            node: drive.node().id().raw(),
            model: drive.description().filter(|_| drive.guess().is_none()).map(|profile| profile.name),
            guess: guessed(drive),
            state: state.power.map_or("no state of CiA 402", |power| power.name()),
            mode: state.mode.map(|mode| mode.0),
            mode_name: state.mode.and_then(ModeOfOperation::name),
            statusword: state.statusword.0,
            bits,
            fault_code: state.fault_code,
            is_faulted: matches!(state.power, Some(PowerState::Fault | PowerState::FaultReactionActive)),
            is_enabled: state.power == Some(PowerState::OperationEnabled),
            faults: faults.collect(),
            motion: ShaftMotion {
                position: state.position.map(|counts| counts.0),
                angle_deg: state.angle.map(|angle| angle.0),
                velocity_rpm: state.velocity.map(|speed| speed.0),
                current_a: state.current.map(|current| current.0),
                position_mm: mm(state.angle.map(|angle| angle.0 / 360.0)),
                velocity_mm_s: mm(state.velocity.map(|speed| speed.0 / 60.0)),
                is_geared: gear != Gear::DIRECT,
            },
            supply_v: state.supply.map(|supply| supply.0),
            motor_c: state.motor_temperature.map(|temperature| temperature.0),
            driver_c: state.driver_temperature.map(|temperature| temperature.0),
            // A boot-up message says only that the node has just left the state it names.
            nmt_state: state.nmt.filter(|nmt| *nmt != NmtState::Initialising).map(|nmt| nmt.to_string()),
            gear: (gear != Gear::DIRECT).then(|| GearReport {
                ratio: gear.ratio(),
                feed_constant_mm: gear.feed_m().map(|metres| metres * 1e3),
                text: gear.to_string(),
            }),
        })
    }

    /// A drive that was enabled and is no longer when it is looked at has not been left enabled.
    pub(super) fn still_enabled(self) -> Result<Self, Failure> {
        if self.is_enabled {
            return Ok(self);
        }
        let Self { node, state, statusword, .. } = self;
        Err(words::failure::Failure::new(format!("node {node}: it did not stay enabled"))
            .of_kind("not_reached")
            .about(node)
            .because(format!("seen: Operation enabled, and right after it {state} (statusword {statusword:04X}h)"))
            .next(format!(
                "find out who else commands it (another master, an RPDO, the enable input), or whether its supply dipped: \
                 ferrodrive explain {node}"
            ))
            .into())
    }

    /// Faults and what to do about them; nothing without one. `gap` lines the texts up with others.
    pub fn fault_lines(&self, paint: Paint, gap: &str) -> Vec<String> {
        if let Some(code) = self.fault_code.filter(|code| *code != 0 && self.faults.is_empty()) {
            return vec![format!("  fault {gap}{}", paint.bad(&format!("{code:04X}h")))];
        }
        if self.is_faulted && self.fault_code == Some(0) {
            let code = paint.bad("without a code");
            return vec![format!("  fault {gap}{code}: the drive is in state {} and shows fault code 0", self.state)];
        }
        let lines = self.faults.iter().flat_map(|fault| {
            let name = paint.bad(&format!("{:04X}h {}", fault.code, fault.name));
            [format!("  fault {gap}{name}"), format!("  remedy{gap}{}", fault.remedy)]
        });
        lines.collect()
    }

    fn power(&self) -> String {
        let parts = [
            self.supply_v.map(|supply| format!("{supply:.1} V")),
            self.motor_c.map(|celsius| format!("motor {celsius:.1} °C")),
            self.driver_c.map(|celsius| format!("driver {celsius:.1} °C")),
        ];
        parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
    }
}

impl ShaftMotion {
    /// In one line.
    pub fn text(&self) -> String {
        // A tenth of an r/min of the output may be many of a shaft behind a gear.
        let decimals = if self.is_geared { 3 } else { 1 };
        let parts = [
            self.position.map(|counts| format!("{counts} counts")),
            self.angle_deg.map(|angle| format!("{angle:.2}°")),
            self.position_mm.map(|mm| format!("{mm:.3} mm")),
            self.velocity_rpm.map(|speed| format!("{speed:.decimals$} r/min")),
            self.velocity_mm_s.map(|speed| format!("{speed:.2} mm/s")),
            self.current_a.map(|current| format!("{current:.1} A")),
        ];
        parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
    }
}

impl StateReport {
    /// As lines for people.
    pub fn text(&self, paint: Paint) -> String {
        let mode = self.mode.map_or_else(|| "unknown mode".into(), |mode| ModeOfOperation(mode).to_string());
        let model = self.model.map(|model| format!(" ({model})")).unwrap_or_default();
        let mut lines = vec![format!("node {}{model}: {}, {mode}", self.node, paint.strong(self.state))];
        lines.push(format!("  statusword  {:04X}h  {}", self.statusword, self.bits.join(", ")));
        lines.extend(self.fault_lines(paint, "      "));
        match self.fault_code {
            Some(0) if !self.is_faulted => lines.push("  fault       none".into()),
            Some(_) => {}
            None => lines.push("  fault       not known: the drive refuses to show its fault code".into()),
        }
        lines.push(format!("  motion      {}", self.motion.text()));
        if let Some(gear) = &self.gear {
            lines.push(format!("  behind      {}: angles and speeds are those of its output", gear.text));
        }
        lines.push(format!("  power       {}", self.power()));
        if let Some(nmt) = &self.nmt_state {
            lines.push(format!("  nmt         {nmt}"));
        }
        lines.join("\n")
    }
}

/// The model that a drive is taken for on the evidence of its objects.
pub fn guessed(drive: &Drive) -> Option<&'static str> {
    drive.guess().filter(|guess| guess.evidence().is_some()).map(|guess| guess.description().name)
}

#[cfg(test)]
mod tests {
    use canopen::NodeId;

    use super::*;

    fn report(power: PowerState) -> StateReport {
        StateReport {
            node: 4,
            model: None,
            guess: None,
            state: power.name(),
            mode: None,
            mode_name: None,
            statusword: 0x0008,
            bits: Vec::new(),
            fault_code: Some(0),
            is_faulted: power == PowerState::Fault,
            is_enabled: power == PowerState::OperationEnabled,
            faults: Vec::new(),
            motion: ShaftMotion {
                position: None,
                angle_deg: None,
                velocity_rpm: None,
                current_a: None,
                position_mm: None,
                velocity_mm_s: None,
                is_geared: false,
            },
            supply_v: None,
            motor_c: None,
            driver_c: None,
            nmt_state: None,
            gear: None,
        }
    }

    #[test]
    fn a_drive_is_enabled_where_the_state_that_is_reported_is_that() {
        let failure = report(PowerState::SwitchOnDisabled).still_enabled().unwrap_err();
        assert_eq!((failure.kind, failure.subject.node.map(NodeId::raw)), ("not_reached", Some(4)));
        assert!(failure.to_string().contains("right after it Switch on disabled (statusword 0008h)"), "{failure}");
        assert!(report(PowerState::OperationEnabled).still_enabled().is_ok());
    }

    #[test]
    fn a_fault_without_a_code_is_not_shown_as_none() {
        let faulted = report(PowerState::Fault);
        let text = faulted.text(Paint::OFF);
        assert!(
            text.contains("  fault       without a code: the drive is in state Fault and shows fault code 0"),
            "{text}"
        );
        assert!(!text.contains("none"), "{text}");
        // What `fault reset` shows too.
        assert_eq!(faulted.fault_lines(Paint::OFF, "  ").len(), 1);
        let text = report(PowerState::SwitchOnDisabled).text(Paint::OFF);
        assert!(text.contains("  fault       none"), "{text}");
    }
}
