//! Machines that several drives move together: a mobile base, a shaft with two motors, an arm. A world holds them
//! ([`World::couple`](crate::World::couple)); the physics is [`plant::coupled`].
//!
//! A coupled drive hands its mechanics over: its control period ends with what the motor does to the shaft, and the shaft moves
//! when the whole machine does. The world brings all drives of a machine up to a moment together, before it lets anything into
//! one of them, so that the order in which they are asked makes no difference.

use plant::coupled::{ArmModel, Body, CommonShaftData, CommonShaftModel, ExternalModel, MOST};
use plant::coupled::{DifferentialDriveData, DifferentialDriveModel};
use serde::Serialize;

use crate::machine::QuantityRange;
use crate::refused::Refused;
use crate::stimulus::{BodyStimulus, Place};

/// What several drives move together.
#[derive(Clone, Debug, PartialEq)]
pub enum Coupling {
    /// Two wheels, the left one first, and a body on them.
    DifferentialDrive(DifferentialDriveModel),
    /// Two to seven motors on one shaft.
    CommonShaft(CommonShaftModel),
    /// One to seven joints, the base first.
    Arm(Box<ArmModel>),
    /// One to seven shafts that a physics engine outside moves: [`World::exchange`](crate::World::exchange).
    External(ExternalModel),
}

/// A drive of a machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoupledShaft {
    /// The drive, by the number under which it was added, and its axis.
    pub place: Place,
    /// Turns of the machine's wheel, shaft or joint per turn of the drive's output shaft. Negative for a motor that sits the other
    /// way round.
    pub turns: f64,
}

impl CoupledShaft {
    /// A drive whose output shaft is the machine's.
    pub const fn direct(place: Place) -> Self {
        Self { place, turns: 1.0 }
    }

    /// A drive whose output shaft is the machine's, but sits the other way round, as the right wheel's motor does.
    pub const fn reversed(place: Place) -> Self {
        Self { place, turns: -1.0 }
    }
}

/// Why drives cannot be coupled.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CouplingError {
    /// A second machine under one name.
    #[error("there is already a body {0:?}")]
    DuplicateName(String),
    /// The wrong number of drives.
    #[error("a {kind} has {least} to {most} drives, not {given}")]
    Count {
        /// The kind of machine.
        kind: &'static str,
        /// How many it takes at least.
        least: usize,
        /// And at most.
        most: usize,
        /// How many were given.
        given: usize,
    },
    /// No drive was added under this number.
    #[error("there is no drive {0}")]
    NoSuchDrive(u8),
    /// One drive in two places.
    #[error("drive {0} is part of a body already; a drive belongs to one body, and to one place in it, an axis each")]
    Taken(Place),
    /// The drive does not move anything that could be coupled.
    #[error("drive {0} moves no shaft")]
    NoShaft(Place),
    /// Control periods of different lengths.
    #[error(
        "drive {0} has a control period of another length or phase than the others; drives of fidelity mechanical are coupled before they start"
    )]
    Period(Place),
    /// A value that makes no sense.
    #[error(transparent)]
    Refused(#[from] Refused),
}

/// Where a machine is and how it moves: what a person beside it could measure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BodyState {
    /// The name under which it was coupled.
    pub name: String,
    /// What it is, and where.
    #[serde(flatten)]
    pub kind: BodyKind,
}

/// The state of each kind of machine.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum BodyKind {
    /// A mobile base: the middle of its axle.
    DifferentialDrive {
        /// Along the x axis, m.
        x_m: f64,
        /// Along the y axis, m.
        y_m: f64,
        /// Direction in degrees from the x axis towards the y axis; many turns.
        heading_deg: f64,
        /// Along the heading, m/s.
        speed_m_s: f64,
        /// Rate of the heading, degrees/s.
        yaw_rate_deg_s: f64,
        /// How far the left and the right wheel have slipped: turned less gone, m.
        slip_m: [f64; 2],
        /// Which of them slips now.
        slips: [bool; 2],
    },
    /// Motors on one shaft.
    CommonShaft {
        /// Its angle since the motors were joined, degrees; many turns.
        angle_deg: f64,
        /// r/min.
        speed_rpm: f64,
    },
    /// A serial arm.
    Arm {
        /// Angles of its joints, the base first, degrees.
        joints_deg: Vec<f64>,
        /// Their velocities, degrees/s.
        joints_deg_s: Vec<f64>,
        /// The tool's point in the frame of the base, m.
        tool_m: [f64; 3],
    },
    /// Shafts that a physics engine outside moves.
    External {
        /// Angles of its joints, degrees.
        joints_deg: Vec<f64>,
        /// Their velocities, degrees/s.
        joints_deg_s: Vec<f64>,
        /// Torque of each drive at its joint less its friction, the mean of the last exchange, N·m.
        torque_nm: Vec<f64>,
    },
}

impl BodyKind {
    /// Every number of it with a name that ends with its unit: `x_m`, `joint2_deg`. The names of one machine are always the same.
    pub fn signals(&self) -> Vec<(String, f64)> {
        let plain =
            |signals: &[(&str, f64)]| signals.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        let numbered = |unit: &'static str, values: &[f64]| {
            let named = values.iter().enumerate().map(|(i, value)| (format!("joint{}_{unit}", i + 1), *value));
            named.collect::<Vec<_>>()
        };
        match self {
            Self::DifferentialDrive { x_m, y_m, heading_deg, speed_m_s, yaw_rate_deg_s, slip_m, slips: _ } => plain(&[
                ("x_m", *x_m),
                ("y_m", *y_m),
                ("heading_deg", *heading_deg),
                ("speed_m_s", *speed_m_s),
                ("yaw_rate_deg_s", *yaw_rate_deg_s),
                ("slip_left_m", slip_m[0]),
                ("slip_right_m", slip_m[1]),
            ]),
            Self::CommonShaft { angle_deg, speed_rpm } => {
                plain(&[("angle_deg", *angle_deg), ("speed_rpm", *speed_rpm)])
            }
            Self::Arm { joints_deg, joints_deg_s, tool_m } => {
                let [x, y, z] = *tool_m;
                let tool: Vec<(String, f64)> = plain(&[("tool_x_m", x), ("tool_y_m", y), ("tool_z_m", z)]);
                [numbered("deg", joints_deg), numbered("deg_s", joints_deg_s), tool].concat()
            }
            Self::External { joints_deg, joints_deg_s, torque_nm } => {
                [numbered("deg", joints_deg), numbered("deg_s", joints_deg_s), numbered("nm", torque_nm)].concat()
            }
        }
    }
}

const MASS: QuantityRange =
    QuantityRange { what: "mass of a body", expected: "0.01 to 100000 kg", least: 0.01, greatest: 1e5 };
const YAW_INERTIA: QuantityRange =
    QuantityRange { what: "yaw inertia", expected: "1e-6 to 1e6 kg·m²", least: 1e-6, greatest: 1e6 };
const LENGTH: QuantityRange =
    QuantityRange { what: "wheel base or wheel radius", expected: "0.001 to 100 m", least: 1e-3, greatest: 100.0 };
const ROLLING: QuantityRange =
    QuantityRange { what: "rolling resistance", expected: "0 to 1 of the weight", least: 0.0, greatest: 1.0 };
const GRIP: QuantityRange =
    QuantityRange { what: "grip", expected: "0.001 to 10 of the weight", least: 1e-3, greatest: 10.0 };
const SHARE: QuantityRange =
    QuantityRange { what: "share of the weight on the wheels", expected: "0.01 to 1", least: 0.01, greatest: 1.0 };
const SLOPE: QuantityRange =
    QuantityRange { what: "slope", expected: "-80 to 80 degrees", least: -80.0, greatest: 80.0 };
const UPHILL: QuantityRange =
    QuantityRange { what: "direction uphill", expected: "-360 to 360 degrees", least: -360.0, greatest: 360.0 };
const PAYLOAD: QuantityRange = QuantityRange { what: "payload", expected: "0 to 100000 kg", least: 0.0, greatest: 1e5 };
const SHAFT: QuantityRange = QuantityRange {
    what: "inertia or friction of the shaft",
    expected: "0 to 1e6 kg·m², N·m or N·m·s/rad",
    least: 0.0,
    greatest: 1e6,
};
const LINK_MASS: QuantityRange =
    QuantityRange { what: "mass of a link", expected: "0 to 100000 kg", least: 0.0, greatest: 1e5 };
const LINK_INERTIA: QuantityRange =
    QuantityRange { what: "inertia of a link", expected: "0 to 1e6 kg·m²", least: 0.0, greatest: 1e6 };
const LINK_LENGTH: QuantityRange =
    QuantityRange { what: "length at a link", expected: "-100 to 100 m", least: -100.0, greatest: 100.0 };
const LINK_ANGLE: QuantityRange =
    QuantityRange { what: "first angle of a joint", expected: "-360 to 360 degrees", least: -360.0, greatest: 360.0 };
/// Beyond that an angle in rad has no room for a step of an encoder.
pub(crate) const JOINT_ANGLE: QuantityRange =
    QuantityRange { what: "angle of a joint", expected: "-1e6 to 1e6 rad", least: -1e6, greatest: 1e6 };
const LINK_AXIS: QuantityRange =
    QuantityRange { what: "length of a joint's axis", expected: "1", least: 1.0 - 1e-6, greatest: 1.0 + 1e-6 };
const TURNS: QuantityRange = QuantityRange {
    what: "turns of the body's shaft per turn of the drive's, without its sign,",
    expected: "0.0001 to 1000",
    least: 1e-4,
    greatest: 1e3,
};

impl Coupling {
    /// The kind of machine, in the word of machine files.
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::DifferentialDrive(_) => "differential-drive",
            Self::CommonShaft(_) => "common-shaft",
            Self::Arm(_) => "arm",
            Self::External(_) => "external",
        }
    }

    /// The machine at rest, if its figures make sense.
    pub(crate) fn body(&self) -> Result<Body, Refused> {
        match self {
            Self::DifferentialDrive(model) => {
                check_base(model)?;
                Ok(Body::DifferentialDrive(*model, DifferentialDriveData::default()))
            }
            Self::CommonShaft(model) => {
                let CommonShaftModel { inertia_kg_m2, coulomb_nm, viscous_nm_s } = *model;
                all(&SHAFT, &[inertia_kg_m2, coulomb_nm, viscous_nm_s])?;
                Ok(Body::CommonShaft(*model, CommonShaftData::default()))
            }
            Self::Arm(model) => {
                check_arm(model)?;
                Ok(Body::Arm(**model, model.at_rest()))
            }
            Self::External(model) => {
                for (first_rad, inertia_kg_m2) in model.joints() {
                    JOINT_ANGLE.check(first_rad)?;
                    SHAFT.check(inertia_kg_m2)?;
                }
                Ok(Body::External(*model, model.at_rest()))
            }
        }
    }
}

fn all(quantity: &QuantityRange, values: &[f64]) -> Result<(), Refused> {
    values.iter().try_for_each(|value| quantity.check(*value).map(|_| ()))
}

fn check_base(model: &DifferentialDriveModel) -> Result<(), Refused> {
    MASS.check(model.mass_kg)?;
    YAW_INERTIA.check(model.yaw_inertia_kg_m2)?;
    all(&LENGTH, &[model.wheel_base_m, model.wheel_radius_m])?;
    ROLLING.check(model.rolling)?;
    model.grip.map_or(Ok(0.0), |grip| GRIP.check(grip))?;
    SHARE.check(model.weight_share)?;
    SLOPE.check(model.slope_rad.to_degrees())?;
    UPHILL.check(model.uphill_rad.to_degrees()).map(|_| ())
}

fn check_arm(model: &ArmModel) -> Result<(), Refused> {
    PAYLOAD.check(model.payload_kg)?;
    all(&LINK_LENGTH, &model.tool_m)?;
    all(&LINK_LENGTH, &model.gravity_m_s2)?;
    for link in model.links() {
        LINK_MASS.check(link.mass_kg)?;
        all(&LINK_INERTIA, &link.inertia_kg_m2)?;
        all(&LINK_LENGTH, &link.offset_m)?;
        all(&LINK_LENGTH, &link.center_m)?;
        LINK_ANGLE.check(link.first_rad.to_degrees())?;
        LINK_AXIS.check(link.axis.iter().map(|part| part * part).sum::<f64>().sqrt())?;
    }
    Ok(())
}

pub(crate) fn check_turns(turns: f64) -> Result<(), Refused> {
    TURNS.check(turns.abs()).map(|_| ())
}

/// Changes one thing at a machine; a refusal changes nothing.
pub(crate) fn change(body: &mut Body, name: &str, stimulus: &BodyStimulus) -> Result<(), Refused> {
    match (body, *stimulus) {
        (Body::DifferentialDrive(model, _), BodyStimulus::Slope { slope_deg, uphill_deg }) => {
            let (slope_deg, uphill_deg) = (SLOPE.check(slope_deg)?, UPHILL.check(uphill_deg)?);
            (model.slope_rad, model.uphill_rad) = (slope_deg.to_radians(), uphill_deg.to_radians());
        }
        (Body::DifferentialDrive(model, _), BodyStimulus::Grip(grip)) => {
            model.grip = grip.map(|grip| GRIP.check(grip)).transpose()?;
        }
        (Body::DifferentialDrive(model, _), BodyStimulus::Mass(mass_kg)) => model.mass_kg = MASS.check(mass_kg)?,
        (Body::Arm(model, _), BodyStimulus::Payload(payload_kg)) => model.payload_kg = PAYLOAD.check(payload_kg)?,
        (Body::DifferentialDrive(..), _) => return Err(lacks(name, "slope, grip and mass")),
        (Body::Arm(..), _) => return Err(lacks(name, "payload")),
        (Body::CommonShaft(..) | Body::External(..), _) => return Err(lacks(name, "nothing")),
    }
    Ok(())
}

fn lacks(name: &str, takes: &'static str) -> Refused {
    Refused::NotOfBody { name: name.to_owned(), takes }
}

/// The state of a machine, for people.
pub(crate) fn state(name: &str, body: &Body) -> BodyState {
    let kind = match body {
        Body::DifferentialDrive(model, data) => BodyKind::DifferentialDrive {
            x_m: data.x_m,
            y_m: data.y_m,
            heading_deg: data.heading_rad.to_degrees(),
            speed_m_s: model.speed_m_s(data),
            yaw_rate_deg_s: model.yaw_rate_rad_s(data).to_degrees(),
            slip_m: data.slip_m,
            slips: data.slips,
        },
        Body::CommonShaft(_, data) => BodyKind::CommonShaft {
            angle_deg: data.angle.as_turns() * 360.0,
            speed_rpm: data.velocity_rad_s * cia402::RPM_PER_RAD_S,
        },
        Body::Arm(model, data) => {
            let degrees =
                |values: &[f64; MOST]| values[..model.links().len()].iter().map(|rad| rad.to_degrees()).collect();
            BodyKind::Arm {
                joints_deg: degrees(&data.angle_rad),
                joints_deg_s: degrees(&data.velocity_rad_s),
                tool_m: model.tool_at_m(data),
            }
        }
        Body::External(model, data) => {
            let shafts = || (0..model.count()).map(|joint| data.shaft(joint));
            BodyKind::External {
                joints_deg: shafts().map(|(angle_rad, _)| angle_rad.to_degrees()).collect(),
                joints_deg_s: shafts().map(|(_, velocity_rad_s)| velocity_rad_s.to_degrees()).collect(),
                torque_nm: (0..model.count()).map(|joint| data.torque_nm(joint)).collect(),
            }
        }
    };
    BodyState { name: name.to_owned(), kind }
}
