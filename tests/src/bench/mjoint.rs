//! The bench of M joints.

use std::sync::LazyLock;

use can::Bitrate;
use drives::engine::storage::StoredImage;
use drives::mjoint::variations::VARIANT;
use drives::mjoint::{Model, storage};
use sim::VirtualDrive;
use sim::machine::{Joint, MJointMachine, Machine, mjoint};

use super::{BenchSubject, ObjectAddress, Rows};
use crate::mjoint::{figures, objects};

pub use super::{Abort, assert_within, head};

/// Counts in one turn of the motor.
pub const TURN: i64 = 32_768;

/// All models, in the order of the manual's columns.
pub const MODELS: [&Model; 4] = [&Model::M4230E17B50, &Model::M4230E17B80, &Model::M8025E25B50, &Model::M8025E25B80];

/// A figure of the technical data, for each of the [`MODELS`].
///
/// # Panics
///
/// If there is no such figure: the test is wrong.
#[must_use]
pub fn figure(parameter: &str) -> [f64; 4] {
    figures().into_iter().find(|figure| figure.parameter == parameter).expect("a figure of the table").values
}

/// A joint of the smallest model.
#[derive(Debug)]
pub struct MJoint;

/// Of all benches the same name.
pub type Drive = MJoint;

/// Its bench.
pub type Bench = super::Bench<MJoint>;

impl BenchSubject for MJoint {
    type Machine = MJointMachine;

    const MODEL: &'static str = "m4230e17b50";
    const NODE: u8 = 1;
    const BITRATE: Bitrate = Bitrate::M1;
    const REFUSED: &'static str = include_str!("../../data/mjoint/refused.csv");
    const AT_REST: &'static str = include_str!("../../data/mjoint/at_rest.csv");

    fn machine() -> MJointMachine {
        mjoint(&Model::M4230E17B50, Self::NODE, Self::BITRATE)
    }

    fn rows() -> &'static Rows {
        static ROWS: LazyLock<Rows> =
            LazyLock::new(|| Rows::new(objects().into_iter().map(|joint| joint.row).collect()));
        &ROWS
    }
}

impl Bench {
    /// Joints of a model at the nodes 1 to `count`.
    #[must_use]
    pub fn of(count: u8, model: &'static Model) -> Self {
        let joint = |node| -> Box<dyn VirtualDrive> { Box::new(mjoint(model, node, MJoint::BITRATE)) };
        Self::with((1..=count).map(joint).collect())
    }

    /// One that is read in another way, with its [`machine`](Self::machine) open to the eye.
    #[must_use]
    #[track_caller]
    pub fn open_as(key: &str, choice: &str) -> Self {
        let mut variant = VARIANT;
        variant.choose(key, choice).expect("a reading of the joint");
        let (model, image) = (&Model::M4230E17B50, StoredImage::of(&storage::addressed(&variant, MJoint::NODE)));
        let firmware = drives::mjoint::MJoint::of(model, variant);
        Self::open_with(Machine::new(firmware, Joint::new(model, image, MJoint::BITRATE)))
    }

    /// Writes to another joint than the first.
    pub fn write_to(&mut self, node: u8, object: impl ObjectAddress, value: i64) -> Result<(), Abort> {
        self.at(node, |bench| bench.write(object, value))
    }

    /// Reads from another joint than the first.
    #[track_caller]
    pub fn get_from(&mut self, node: u8, object: impl ObjectAddress) -> i64 {
        self.at(node, |bench| bench.get(object))
    }

    #[track_caller]
    fn at<T>(&mut self, node: u8, talk: impl FnOnce(&mut Self) -> T) -> T {
        let usual = std::mem::replace(&mut self.node, node);
        let result = talk(self);
        self.node = usual;
        result
    }

    /// 6064h.
    pub fn position(&mut self) -> i64 {
        self.get(0x6064)
    }

    /// Lets time pass until the target is reached; panics after `limit_ms`.
    #[track_caller]
    pub fn reaches(&mut self, limit_ms: u64) -> &mut Self {
        self.until(limit_ms, |bench| bench.statusword() & 0x0400 != 0);
        self
    }

    /// Enabled in speed mode with this target.
    #[track_caller]
    pub fn turn(&mut self, rpm: i64) -> &mut Self {
        self.set(0x6060, 3).set(0x60FF, rpm).set(0x6040, 0x0F)
    }

    /// 2614h = 1, and its 2.
    #[track_caller]
    pub fn save(&mut self) -> &mut Self {
        self.set(0x2614, 1).run_ms(5).reads(0x2614, 2)
    }
}
