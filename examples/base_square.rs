//! A base on two hub motors drives a square of a metre by its odometry alone; where it ends is held to where the simulated body
//! truly is.
#![allow(clippy::print_stdout, reason = "an example shows what it does")]

use std::error::Error;
use std::f64::consts::FRAC_PI_2;
use std::time::Duration;

use can::Bitrate;
use canopen::NodeId;
use cia402::ModeOfOperation;
use master::base::{Base, BaseLimits, Geometry, Pose, Twist, WheelSetup};
use master::cyclic::CyclicOptions;
use master::{Drive, Network};
use plant::coupled::DifferentialDriveModel;
use sim::coupling::{BodyKind, CoupledShaft, Coupling};
use sim::machine::{Order, order};
use sim::{Place, World};

const GEOMETRY: Geometry = Geometry { wheel_base_m: 0.40, wheel_radius_m: 0.084 };

const LIMITS: BaseLimits = BaseLimits {
    linear_m_s: 0.5,
    angular_rad_s: 1.5,
    wheel_m_s: 0.6,
    wheel_m_s2: 0.5,
    watchdog: Duration::from_millis(200),
    lag_m: 0.15,
};

const PERIOD: Duration = Duration::from_millis(10);
const SIDE_M: f64 = 1.0;

/// The speed from which a base with this deceleration stops within the way that is left: v^2 = 2 a s. With some of it in hand.
fn speed(left: f64, deceleration: f64, most: f64) -> f64 {
    (2.0 * 0.6 * deceleration * left.abs()).sqrt().min(most).copysign(left)
}

/// Drives until nothing is left of what `left` finds in the pose.
async fn until(
    base: &mut Base,
    enough: f64,
    left: impl Fn(Pose) -> f64,
    twist: impl Fn(f64, Pose) -> Twist,
) -> Result<(), Box<dyn Error>> {
    // A minute is much more than any side takes.
    for _ in 0..6000 {
        let pose = base.state().pose;
        let remaining = left(pose);
        if remaining.abs() < enough {
            return Ok(base.stop().await?);
        }
        base.command(twist(remaining, pose))?;
        if let Some(cause) = base.cycle().await?.cause {
            return Err(cause.to_string().into());
        }
    }
    Err("the base did not arrive within a minute".into())
}

async fn square(base: &mut Base) -> Result<(), Box<dyn Error>> {
    base.enable().await?;
    for corner in 0..4 {
        let (from, heading) = (base.state().pose, f64::from(corner) * FRAC_PI_2);
        let way = |pose: Pose| (pose.x_m - from.x_m) * heading.cos() + (pose.y_m - from.y_m) * heading.sin();
        until(
            base,
            0.004,
            |pose| SIDE_M - way(pose),
            |left, pose| Twist {
                linear_m_s: speed(left, LIMITS.wheel_m_s2, LIMITS.linear_m_s),
                angular_rad_s: 2.0 * (heading - pose.heading_rad),
            },
        )
        .await?;
        let next = heading + FRAC_PI_2;
        // On the spot a wheel goes half the wheel base for each radian.
        let deceleration = LIMITS.wheel_m_s2 / (0.5 * GEOMETRY.wheel_base_m);
        until(
            base,
            0.01,
            |pose| next - pose.heading_rad,
            |left, _| Twist { linear_m_s: 0.0, angular_rad_s: speed(left, deceleration, LIMITS.angular_rad_s) },
        )
        .await?;
    }
    // The last of the way that the wheels turn without a set-point.
    for _ in 0..50 {
        base.cycle().await?;
    }
    Ok(())
}

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let model = devices::model("zlac8030l").ok_or("no such model")?;
    let mut world = World::new(Bitrate::K500, 1);
    let network = Network::new();
    world.add_station(network.clone());
    let mut wheels = Vec::new();
    // The right motor sits the other way round.
    for (number, turns) in [(1, 1.0), (2, -1.0)] {
        let node = NodeId::new(number).ok_or("no node-ID")?;
        world.add_drive(number, order(model, &Order::new(model, node, Bitrate::K500))?)?;
        let drive = Drive::new(network.node(node), model);
        wheels.push(WheelSetup { drive, mode: ModeOfOperation::PROFILE_VELOCITY, turns });
    }
    let body = DifferentialDriveModel {
        mass_kg: 40.0,
        yaw_inertia_kg_m2: 1.5,
        wheel_base_m: GEOMETRY.wheel_base_m,
        wheel_radius_m: GEOMETRY.wheel_radius_m,
        rolling: 0.015,
        grip: Some(0.8),
        weight_share: 0.7,
        slope_rad: 0.0,
        uphill_rad: 0.0,
    };
    let shafts = [CoupledShaft::direct(Place::node(1)), CoupledShaft::reversed(Place::node(2))];
    world.couple("base", &Coupling::DifferentialDrive(body), &shafts)?;
    world.run_for(Duration::from_secs(1));
    let pose = sim::block_on(&mut world, async {
        let mut base = Base::open([&wheels[0], &wheels[1]], GEOMETRY, LIMITS, PERIOD, CyclicOptions::default()).await?;
        square(&mut base).await?;
        let pose = base.state().pose;
        base.close().await?;
        Ok::<_, Box<dyn Error>>(pose)
    })??;
    let Some(BodyKind::DifferentialDrive { x_m, y_m, heading_deg, .. }) = world.body("base").map(|body| body.kind)
    else {
        return Err("the body is gone".into());
    };
    let (counted, missed) = ((pose.x_m - x_m).hypot(pose.y_m - y_m), x_m.hypot(y_m));
    let heading_off_deg = heading_deg - 360.0;
    println!("a square of {SIDE_M} m: it ends {:.1} mm and {heading_off_deg:.2} degrees from its start", missed * 1e3);
    println!("its odometry is {:.1} mm from where the body truly is", counted * 1e3);
    if missed > 0.05 || counted > 0.01 || heading_off_deg.abs() > 3.0 {
        return Err("the square was not closed".into());
    }
    Ok(())
}
