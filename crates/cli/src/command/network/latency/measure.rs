//! The measurement: first requests, one after the other, then cycles of SYNC.

use std::time::Duration;

use can::{BusFrame, Instant};
use canopen::object::DEVICE_TYPE;
use canopen::pdo::TransmissionType;
use canopen::{CobId, Mux, NodeId};
use cia402::Statusword;
use master::latency::{Meter, Sample};
use master::{Error, Node};

use super::spread::Times;
use crate::context::Context;
use crate::failure::Failure;

/// How long another producer's SYNC is waited for: longer than any period that a machine runs at.
const LISTEN_TIME: Duration = Duration::from_millis(500);

/// How often it is looked at what has come.
const LOOK_PERIOD: Duration = Duration::from_millis(50);

/// TPDOs that are looked at: those of the predefined connection set.
const TPDOS: u16 = 4;

/// Objects of a further axis lie this far behind those of the one before (CiA 402-1).
const AXIS_OFFSET: u16 = 0x800;

/// Axes that CiA 402 lets a node have.
const AXES: u16 = 8;

/// What was measured.
#[derive(Default)]
pub(super) struct Measured {
    pub(super) sdo: Times,
    pub(super) pdo: Times,
    pub(super) sync: Times,
    pub(super) producer: Option<&'static str>,
    pub(super) notes: Vec<String>,
}

pub(super) struct Measurement<'a> {
    context: &'a Context,
    node: Option<Node>,
    meter: Meter,
    count: u64,
    duration: Option<Duration>,
    /// Requests are being measured.
    asks: bool,
    /// There are TPDOs that come with SYNC.
    watches: bool,
    measured: Measured,
}

impl<'a> Measurement<'a> {
    /// A measurement of the answers of `node`, if there is one, and of SYNC.
    pub(super) fn new(context: &'a Context, node: Option<NodeId>, count: u32, duration: Option<Duration>) -> Self {
        context.traffic.listen();
        Self {
            context,
            node: node.map(|id| context.node(id)),
            meter: Meter::new(node),
            count: u64::from(count),
            duration,
            asks: false,
            watches: false,
            measured: Measured::default(),
        }
    }

    /// Measures. SYNC is produced each `period` if no other node does.
    pub(super) async fn run(mut self, period: Duration) -> Result<Measured, Failure> {
        let node = self.node.clone();
        if let Some(node) = &node {
            self.ask(node).await?;
        }
        if self.hears_sync().await {
            self.measured.producer = Some("another");
        } else if let Some(energised) = self.energised().await {
            self.measured.notes.push(format!(
                "no SYNC was sent: the motor of node {energised} is switched on, and SYNC would activate what its synchronous \
                 RPDOs hold"
            ));
            return Ok(self.measured);
        } else {
            self.measured.producer = Some("this");
        }
        if let Some(node) = &node {
            self.watch_tpdos(node).await?;
        }
        self.cycles(period).await;
        Ok(self.measured)
    }

    /// Reads one object again and again.
    async fn ask(&mut self, node: &Node) -> Result<(), Failure> {
        self.fetch();
        let end = self.end();
        self.asks = true;
        for asked in 0..self.count {
            match node.upload(DEVICE_TYPE).await {
                // The node is there, if not with this object.
                Ok(_) | Err(Error::Aborted { .. }) => {}
                Err(error) if self.measured.sdo.count() == 0 => return Err(error.into()),
                // Counted by the meter.
                Err(_) => {}
            }
            self.fetch();
            if asked % 64 == 0 {
                self.context.progress.count(format!("{} of {} answers", self.measured.sdo.count(), self.count));
            }
            if self.is_over(end) {
                break;
            }
        }
        self.asks = false;
        Ok(())
    }

    async fn hears_sync(&mut self) -> bool {
        self.fetch();
        self.meter.pause();
        self.context.progress.show("listening for SYNC");
        self.context.network.sleep(LISTEN_TIME).await;
        self.fetch();
        self.measured.sync.count() > 0
    }

    /// A node whose motor is switched on, if there is one on the bus.
    async fn energised(&self) -> Option<NodeId> {
        let asked = |count| self.context.progress.count(format!("is a motor switched on? asked {count} of 127"));
        for found in self.context.network.scan(self.context.timeout(), asked).await {
            let node = self.context.node(found.node);
            for axis in 0..AXES {
                let statusword = node.read::<u16>(Mux::new(0x6041 + axis * AXIS_OFFSET, 0)).await;
                match statusword.map(Statusword) {
                    Ok(word) if word.has(Statusword::OPERATION_ENABLED) => return Some(found.node),
                    Ok(_) => {}
                    Err(_) => break,
                }
            }
        }
        None
    }

    /// Has the meter wait for those TPDOs of the node that come with SYNC.
    async fn watch_tpdos(&mut self, node: &Node) -> Result<(), Failure> {
        let mut watched = 0;
        for index in (0..TPDOS).map(|number| 0x1800 + number) {
            let cob_id = match node.read::<u32>(Mux::new(index, 1)).await {
                Ok(raw) => CobId(raw),
                Err(Error::Aborted { .. }) => continue,
                Err(error) => return Err(error.into()),
            };
            let transmission = node.read::<u8>(Mux::new(index, 2)).await?;
            if let (true, Ok(TransmissionType::SynchronousCyclic(every))) =
                (cob_id.is_valid(), TransmissionType::from_raw(transmission))
            {
                self.meter.watch_tpdo(cob_id.can_id(), every);
                watched += 1;
            }
        }
        self.watches = watched > 0;
        if watched == 0 {
            self.measured.notes.push(format!(
                "node {} has no TPDO that comes with SYNC (transmission type 1 to 240 in 1800h:02 to {:X}h:02)",
                node.id(),
                0x1800 + TPDOS - 1
            ));
        }
        Ok(())
    }

    /// Waits for the SYNCs.
    async fn cycles(&mut self, period: Duration) {
        let produces = self.measured.producer == Some("this");
        let end = self.end();
        self.fetch();
        self.meter.pause();
        self.measured.sync = Times::default();
        if produces {
            self.context.network.sync(Some(period));
        }
        let mut last = (0, self.context.network.now());
        while self.measured.sync.count() < self.count && !self.is_over(end) {
            self.context.network.sleep(LOOK_PERIOD).await;
            self.fetch();
            let (count, now) = (self.measured.sync.count(), self.context.network.now());
            self.context.progress.count(format!("{count} of {} SYNCs", self.count));
            if count > last.0 {
                last = (count, now);
            } else if now - last.1 > LISTEN_TIME + 4 * period {
                self.measured.notes.push("SYNC stopped, and the measurement ended".into());
                break;
            }
        }
        if produces {
            self.context.network.sync(None);
        }
        if self.watches && self.measured.pdo.count() == 0 {
            self.measured.notes.push("no TPDO followed SYNC: is the node operational?".into());
        }
    }

    fn fetch(&mut self) {
        while let Some(BusFrame { at, frame, .. }) = self.context.traffic.take() {
            self.meter.handle_frame(&frame, at);
        }
        while let Some(sample) = self.meter.poll_sample() {
            match sample {
                // Other requests are not part of the measurement.
                Sample::Sdo(_) | Sample::SdoLost if !self.asks => {}
                Sample::Sdo(time) => self.measured.sdo.record(time),
                Sample::SdoLost => self.measured.sdo.lose(),
                Sample::Pdo(time) => self.measured.pdo.record(time),
                Sample::PdoLost => self.measured.pdo.lose(),
                Sample::SyncPeriod(time) => self.measured.sync.record(time),
            }
        }
    }

    fn end(&self) -> Option<Instant> {
        self.duration.map(|duration| self.context.network.now() + duration)
    }

    fn is_over(&self, end: Option<Instant>) -> bool {
        end.is_some_and(|end| self.context.network.now() >= end)
    }
}
