//! A serial arm of up to seven turning joints: gravity, inertia that depends on the pose, coupling between the joints.
//!
//! ```text
//! (M(q) + J) a + h(q, v) = torque - friction         J: the motors' inertia behind their gears
//! ```
//!
//! `M` comes from the links' Jacobians, `h` (gravity, Coriolis and centrifugal torques) from the recursive Newton-Euler equations
//! (J. Luh, M. Walker, R. Paul, 1980), both in the frame of the base. A step takes them at the pose in its middle. Links and
//! gears are stiff: what an elastic reducer adds to a joint of its own is left out here.

#![expect(clippy::needless_range_loop, reason = "the indices are those of the equations")]

use super::friction::{MOST, System};
use super::vector::{NO_TURN, Rotation, Vector, add, cross, dot, scaled, sub, through_inertia, turned, turned_about};
use crate::attachment::GRAVITY_M_S2;
use crate::shaft::{Motion, Push};

/// One joint and the link behind it. Its frame is that of the link before, moved by the offset and turned about the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// Place of the joint in the frame of the link before, m.
    pub offset_m: [f64; 3],
    /// Axis of the joint in that frame, of length 1.
    pub axis: [f64; 3],
    /// Mass of the link, kg.
    pub mass_kg: f64,
    /// Its centre of mass in its own frame, m.
    pub center_m: [f64; 3],
    /// Its moments of inertia about axes through that, parallel to those of its frame, kg·m².
    pub inertia_kg_m2: [f64; 3],
    /// Angle of the joint when the arm is put together, rad.
    pub first_rad: f64,
}

/// What never changes about an arm, or only when the user changes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmModel {
    links: [Link; MOST],
    count: usize,
    /// Acceleration of gravity in the frame of the base, m/s².
    pub gravity_m_s2: [f64; 3],
    /// The tool's point in the frame of the last link, m.
    pub tool_m: [f64; 3],
    /// Mass that hangs there, kg.
    pub payload_kg: f64,
}

/// Its state.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ArmData {
    /// Angles of the joints, rad.
    pub angle_rad: [f64; MOST],
    /// Their velocities, rad/s.
    pub velocity_rad_s: [f64; MOST],
    change_rad_s: [f64; MOST],
}

/// Where the links are.
struct Pose {
    turn: [Rotation; MOST],
    axis: [Vector; MOST],
    joint: [Vector; MOST],
    center: [Vector; MOST],
    tool: Vector,
}

impl ArmModel {
    /// An arm of these links, the base first; z points up and nothing hangs at the end of the last link. `None` without a link,
    /// or with more than [`MOST`].
    pub fn new(links: &[Link]) -> Option<Self> {
        let first = *links.first()?;
        let mut all = [first; MOST];
        all.get_mut(..links.len())?.copy_from_slice(links);
        let gravity_m_s2 = [0.0, 0.0, -GRAVITY_M_S2];
        Some(Self { links: all, count: links.len(), gravity_m_s2, tool_m: [0.0; 3], payload_kg: 0.0 })
    }

    /// Its links.
    pub fn links(&self) -> &[Link] {
        &self.links[..self.count]
    }

    /// The arm as it is put together, at rest.
    pub fn at_rest(&self) -> ArmData {
        let mut data = ArmData::default();
        for (angle, link) in data.angle_rad.iter_mut().zip(self.links()) {
            *angle = link.first_rad;
        }
        data
    }

    /// Place of the tool's point in the frame of the base, m.
    pub fn tool_at_m(&self, data: &ArmData) -> [f64; 3] {
        self.pose(&data.angle_rad).tool
    }

    /// Torques that hold the arm against gravity, N·m.
    pub fn gravity_torque_nm(&self, data: &ArmData) -> [f64; MOST] {
        self.bias_nm(&self.pose(&data.angle_rad), &[0.0; MOST])
    }

    /// Energy of the moving links and of their height, J.
    pub fn energy_j(&self, data: &ArmData) -> f64 {
        let pose = self.pose(&data.angle_rad);
        let mass = self.mass_kg_m2(&pose);
        let v = &data.velocity_rad_s;
        let pairs = (0..self.count).flat_map(|i| (0..self.count).map(move |j| (i, j)));
        let kinetic: f64 = pairs.map(|(i, j)| 0.5 * mass[i][j] * v[i] * v[j]).sum();
        let lifted = |kg: f64, at: Vector| -kg * dot(self.gravity_m_s2, at);
        let height: f64 = (0..self.count).map(|k| lifted(self.links[k].mass_kg, pose.center[k])).sum();
        kinetic + height + lifted(self.payload_kg, pose.tool)
    }

    pub(super) fn step(&self, data: &mut ArmData, dt_s: f64, pushes: &[Push]) -> [Motion; MOST] {
        let before = data.velocity_rad_s;
        let middle: [f64; MOST] = core::array::from_fn(|i| before[i] + 0.5 * data.change_rad_s[i]);
        let half_way = core::array::from_fn(|i| data.angle_rad[i] + 0.5 * dt_s * before[i]);
        let pose = self.pose(&half_way);
        let bias_nm = self.bias_nm(&pose, &middle);
        let mut system = System::new(self.count);
        system.matrix = self.mass_kg_m2(&pose);
        for i in 0..self.count {
            system.matrix[i][i] += at(pushes, i).inertia_kg_m2;
        }
        for i in 0..self.count {
            let momentum: f64 = (0..self.count).map(|j| system.matrix[i][j] * before[j]).sum();
            let Push { torque_nm, viscous_nm_s, dry_nm, .. } = at(pushes, i);
            system.push[i] = torque_nm - bias_nm[i] + momentum / dt_s - 0.5 * viscous_nm_s * before[i];
            system.dry[i] = dry_nm;
        }
        for i in 0..self.count {
            for j in 0..self.count {
                system.matrix[i][j] /= dt_s;
            }
            system.matrix[i][i] += 0.5 * at(pushes, i).viscous_nm_s;
        }
        let after = system.velocities(&before);
        let friction_nm = system.friction(&after);
        core::array::from_fn(|i| {
            let mean_rad_s = 0.5 * (before[i] + after[i]);
            data.angle_rad[i] += mean_rad_s * dt_s;
            data.change_rad_s[i] = if after[i] == 0.0 { 0.0 } else { after[i] - before[i] };
            data.velocity_rad_s[i] = after[i];
            Motion { velocity_rad_s: after[i], mean_rad_s, dry_nm: friction_nm[i] }
        })
    }

    fn pose(&self, angle_rad: &[f64; MOST]) -> Pose {
        let none = [[0.0; 3]; MOST];
        let mut pose = Pose { turn: [NO_TURN; MOST], axis: none, joint: none, center: none, tool: [0.0; 3] };
        let (mut turn, mut place) = (NO_TURN, [0.0; 3]);
        for (i, link) in self.links().iter().enumerate() {
            place = add(place, turned(&turn, link.offset_m));
            pose.axis[i] = turned(&turn, link.axis);
            turn = turned_about(&turn, link.axis, libm::sincos(angle_rad[i]));
            pose.joint[i] = place;
            pose.turn[i] = turn;
            pose.center[i] = add(place, turned(&turn, link.center_m));
        }
        pose.tool = add(place, turned(&turn, self.tool_m));
        pose
    }

    /// The links' inertia at the joints.
    fn mass_kg_m2(&self, pose: &Pose) -> [[f64; MOST]; MOST] {
        let mut mass = [[0.0; MOST]; MOST];
        for k in 0..self.count {
            let link = &self.links[k];
            let moved = |i: usize, at: Vector| cross(pose.axis[i], sub(at, pose.joint[i]));
            for i in 0..=k {
                let swung = through_inertia(&pose.turn[k], link.inertia_kg_m2, pose.axis[i]);
                for j in 0..=i {
                    mass[i][j] += link.mass_kg * dot(moved(i, pose.center[k]), moved(j, pose.center[k]))
                        + dot(swung, pose.axis[j]);
                    if k + 1 == self.count && self.payload_kg > 0.0 {
                        mass[i][j] += self.payload_kg * dot(moved(i, pose.tool), moved(j, pose.tool));
                    }
                }
            }
        }
        for i in 0..self.count {
            for j in 0..i {
                mass[j][i] = mass[i][j];
            }
        }
        mass
    }

    /// Torques at the joints without any acceleration of them: out from the base with the velocities, and back with the forces.
    fn bias_nm(&self, pose: &Pose, velocity_rad_s: &[f64; MOST]) -> [f64; MOST] {
        let (mut spin, mut spin_rate) = ([0.0; 3], [0.0; 3]);
        // The base seems to be lifted with what gravity is.
        let mut rise = scaled(self.gravity_m_s2, -1.0);
        let mut place = [0.0; 3];
        let (mut force, mut moment) = ([[0.0; 3]; MOST], [[0.0; 3]; MOST]);
        let swing = |spin: Vector, rate: Vector, arm: Vector| add(cross(rate, arm), cross(spin, cross(spin, arm)));
        for (k, link) in self.links().iter().enumerate() {
            rise = add(rise, swing(spin, spin_rate, sub(pose.joint[k], place)));
            place = pose.joint[k];
            let own = scaled(pose.axis[k], velocity_rad_s[k]);
            spin_rate = add(spin_rate, cross(spin, own));
            spin = add(spin, own);
            let arm = sub(pose.center[k], place);
            force[k] = scaled(add(rise, swing(spin, spin_rate, arm)), link.mass_kg);
            let inertia = |a: Vector| through_inertia(&pose.turn[k], link.inertia_kg_m2, a);
            moment[k] = add(add(inertia(spin_rate), cross(spin, inertia(spin))), cross(arm, force[k]));
            if k + 1 == self.count && self.payload_kg > 0.0 {
                let arm = sub(pose.tool, place);
                let pull = scaled(add(rise, swing(spin, spin_rate, arm)), self.payload_kg);
                force[k] = add(force[k], pull);
                moment[k] = add(moment[k], cross(arm, pull));
            }
        }
        let mut torque_nm = [0.0; MOST];
        for k in (0..self.count).rev() {
            torque_nm[k] = dot(pose.axis[k], moment[k]);
            if k > 0 {
                force[k - 1] = add(force[k - 1], force[k]);
                let lever = cross(sub(pose.joint[k], pose.joint[k - 1]), force[k]);
                moment[k - 1] = add(moment[k - 1], add(moment[k], lever));
            }
        }
        torque_nm
    }
}

fn at(pushes: &[Push], i: usize) -> Push {
    pushes.get(i).copied().unwrap_or_default()
}
