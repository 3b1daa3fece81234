//! PDOs of a node: their configuration and why one is not sent, the writes of a change and its effect on the bus, and the change as a
//! transaction.
//!
//! A change is handled as for parameters: planned in the order of CiA 301 (7.5.2.35 to 7.5.2.38), written to a drive at rest, each
//! value read back, all or nothing. Reading needs no control.

pub(crate) mod load;
mod rows;

use std::collections::BTreeMap;
use std::time::Duration;

use can::{Bitrate, Instant};
use canopen::od::Entry;
use canopen::pdo::{EventTrigger, MappingRecord, PdoId};
use canopen::{CobId, Mux, NmtCommand, NodeId, connection_set};
use devices::Description;
use machine::file::pdo_id;
use master::Drive;
use master::core::PdoMap;
use master::parameters::Parameters;
use master::pdo::{PdoConfig, PdoUnfit, Silence, Situation, TimerUnits, TransmissionType, why_silent};
use master::plan::NodeTraffic;
use serde_json::{Value, json};
use words::object::{ObjectArg, object};

use crate::command::{NewEntry, NewPdo, NmtChange, PdoCommand};
use crate::parameters::transactions::{Change, Refusal};
use crate::parameters::{answer, busy, plan, plan_json, refuse, row, write};
use crate::pdo::load::{PlannedPdos, compared};
use crate::pdo::rows::{config_json, pdo_json};
use crate::state::Host;
use crate::work::{Asked, Done};

/// Most PDOs in one request.
const MOST_PDOS: usize = 64;

/// Periods of SYNC for which a load is computed: shorter ones do not hold two frames at 1 Mbit/s.
const CYCLES: std::ops::RangeInclusive<Duration> = Duration::from_micros(250)..=Duration::from_secs(60);

impl Host {
    /// Executes a command about the PDOs of a node, or starts it.
    pub(crate) fn take_pdos(&mut self, node: NodeId, command: PdoCommand, asked: Asked) {
        match command {
            PdoCommand::Pdos {} => self.begin_reading_pdos(node, asked),
            PdoCommand::PlanPdos { pdos, cycle_ms, bitrate } => {
                self.begin_planning_pdos(node, pdos, (cycle_ms, bitrate), asked);
            }
            PdoCommand::WritePdos { pdos } => match self.known_model(node) {
                Err(refusal) => refuse(asked, refusal),
                Ok((drive, model)) => {
                    let journals = self.setting.journals.clone();
                    self.begin_transaction(node, Change::Pdos, asked, async move {
                        let wanted = wanted(&drive, model, &pdos).await.map_err(|refusal| (refusal, None))?;
                        write(&drive, model, &wanted, journals.as_deref()).await
                    });
                }
            },
            PdoCommand::Nmt { command } => self.command_nmt(node, command, asked),
        }
    }

    fn begin_reading_pdos(&mut self, node: NodeId, asked: Asked) {
        if !self.nodes.contains_key(&node) {
            return refuse(asked, ("no_such_drive", format!("no node was found at node-ID {node}: scan the bus")));
        }
        if !self.parameters.begin_reading() {
            return refuse(asked, busy("too many reads are under way"));
        }
        let drive = self.drive_or_unknown(node);
        self.work.push(Box::pin(async move {
            let read = NodeTraffic::of(&drive).await.map_err(|error| (error.kind(), error.to_string()));
            Done::PdosRead(asked, node, Box::new(read))
        }));
    }

    /// A read of PDOs has ended.
    pub(crate) fn conclude_reading_pdos(&mut self, asked: Asked, node: NodeId, read: Result<NodeTraffic, Refusal>) {
        let shown = read.map(|traffic| {
            let shown = self.pdos_json(&traffic);
            self.traffic.insert(node, traffic);
            shown
        });
        self.conclude_looking(asked, shown);
    }

    fn pdos_json(&self, traffic: &NodeTraffic) -> Value {
        let (node, now) = (traffic.node, self.network.now());
        let drive = self.drive_or_unknown(node);
        let model = drive.description();
        let row = |(config, cob_id): &(PdoConfig, CobId)| {
            pdo_json(model, config, *cob_id, &self.why_silent(node, model, config, *cob_id, now))
        };
        let nmt = self.network.facts(node).probable_state(model);
        json!({
            "node": node.raw(),
            "model": model.map(|model| model.name),
            "manual": model.map(|model| model.manual),
            "nmt": nmt.map(|state| state.to_string()),
            "sync_heard": self.heard_ids.comes(connection_set::SYNC, now),
            "can_undo": self.parameters.last_was_of_pdos(node),
            "can_store": model.is_some_and(|model| model.storage.save.is_some()),
            "bitrate": self.setting.bitrate.map(Bitrate::bits_per_second),
            "pdos": traffic.pdos.iter().map(row).collect::<Vec<_>>(),
        })
    }

    fn why_silent(
        &self,
        node: NodeId,
        model: Option<&'static Description>,
        config: &PdoConfig,
        cob_id: CobId,
        now: Instant,
    ) -> Vec<Silence> {
        let situation = Situation {
            nmt: self.network.facts(node).probable_state(model),
            event_trigger: model.map_or(EventTrigger::Change, |model| model.pdo.event_trigger),
            sync_heard: self.heard_ids.comes(connection_set::SYNC, now),
            heard: self.heard_ids.comes(cob_id.can_id(), now),
        };
        why_silent(config, cob_id, &situation)
    }

    fn begin_planning_pdos(
        &mut self,
        node: NodeId,
        pdos: Vec<NewPdo>,
        (cycle_ms, bitrate): (f64, Option<u32>),
        asked: Asked,
    ) {
        let (drive, model) = match self.known_model(node) {
            Ok(known) => known,
            Err(refusal) => return refuse(asked, refusal),
        };
        let (cycle, bitrate) = match (cycle_of(cycle_ms), bitrate.map(bitrate_of).transpose()) {
            (Ok(cycle), Ok(bitrate)) => (cycle, bitrate.or(self.setting.bitrate)),
            (Err(why), _) | (_, Err(why)) => return refuse(asked, ("malformed", why)),
        };
        if !self.parameters.begin_reading() {
            return refuse(asked, busy("too many reads are under way"));
        }
        self.work.push(Box::pin(async move {
            let planning = async {
                let wanted = wanted(&drive, model, &pdos).await?;
                let plan = plan_json(&plan(&drive, model, &wanted).await?, model);
                Ok(PlannedPdos { node, model, wanted: wanted.values, plan, cycle, bitrate })
            };
            Done::PdosPlanned(asked, Box::new(planning.await))
        }));
    }

    /// A change was planned, or refused: its effect on the bus is computed from what is known of all nodes.
    pub(crate) fn conclude_planning_pdos(&mut self, asked: Asked, planned: Result<PlannedPdos, Refusal>) {
        let shown = planned.and_then(|planned| self.planned_json(planned));
        self.conclude_looking(asked, shown);
    }

    fn planned_json(&self, planned: PlannedPdos) -> Result<Value, Refusal> {
        let PlannedPdos { node, model, wanted, plan: mut shown, cycle, bitrate } = planned;
        let now = self.traffic.get(&node).ok_or_else(|| busy("the PDOs of the node are being read"))?;
        let after = now.pdos.iter().map(|(config, cob_id)| config.with_values(*cob_id, &wanted, model));
        let changed = NodeTraffic { pdos: after.collect(), ..now.clone() };
        let at = self.network.now();
        let is_asked =
            |pdo: PdoId| wanted.keys().any(|object| PdoId::of_object(object.index).is_some_and(|(id, _)| id == pdo));
        let pdos = changed.pdos.iter().filter(|(config, _)| is_asked(config.pdo)).map(|(config, cob_id)| {
            config_json(Some(model), config, *cob_id, &self.why_silent(node, Some(model), config, *cob_id, at))
        });
        shown["pdos"] = pdos.collect();
        shown["bus"] = json!(bitrate.map(|bitrate| compared(&self.traffic, changed, cycle, bitrate)));
        Ok(shown)
    }

    /// A node may be taken out of operational unless it is moved by its PDOs.
    fn command_nmt(&mut self, node: NodeId, command: NmtChange, asked: Asked) {
        if !self.nodes.contains_key(&node) {
            return refuse(asked, ("no_such_drive", format!("no node was found at node-ID {node}: scan the bus")));
        }
        let is_at_work = self.running.contains_key(&node) || self.network.moved().contains(node);
        if command == NmtChange::PreOperational && is_at_work {
            return refuse(asked, busy("this studio is moving the drive"));
        }
        self.network.node(node).nmt(match command {
            NmtChange::Start => NmtCommand::Start,
            NmtChange::PreOperational => NmtCommand::EnterPreOperational,
        });
        answer(asked, Ok(json!({ "node": node.raw() })));
    }
}

fn cycle_of(cycle_ms: f64) -> Result<Duration, String> {
    let cycle = Duration::try_from_secs_f64(cycle_ms / 1e3).ok().filter(|cycle| CYCLES.contains(cycle));
    cycle.ok_or_else(|| format!("expected a SYNC period from 0.25 to 60000 ms, got {cycle_ms}"))
}

fn bitrate_of(bits_per_second: u32) -> Result<Bitrate, String> {
    let known = Bitrate::new(bits_per_second);
    known.ok_or_else(|| format!("expected a bit rate from 1000 to 1000000 bit/s, got {bits_per_second}"))
}

/// The values for the objects of these PDOs. Omitted fields stay as they are in the drive.
async fn wanted(drive: &Drive, model: &'static Description, pdos: &[NewPdo]) -> Result<Parameters, Refusal> {
    if pdos.is_empty() || pdos.len() > MOST_PDOS {
        return Err(("malformed", format!("expected 1 to {MOST_PDOS} PDOs, got {}", pdos.len())));
    }
    let node = drive.node().id();
    let mut values = BTreeMap::new();
    for new in pdos {
        let pdo = pdo_id(&new.pdo).map_err(|why| ("malformed", why))?;
        if let Err(error @ PdoUnfit::NoSuchPdo { .. }) = PdoConfig::new(pdo, PdoMap::default()).values(model, node) {
            return Err(unfit(&error));
        }
        let read = drive.node().pdo_config(pdo, TimerUnits::of(model)).await;
        let (now, cob_id) = read.map_err(|error| (error.kind(), error.to_string()))?;
        for (object, value) in values_of(model, node, new, &now, cob_id)? {
            if values.insert(object, value).is_some() {
                return Err(("malformed", format!("{pdo} is named twice")));
            }
        }
    }
    Ok(Parameters { node: Some(node), values, ..Parameters::default() })
}

/// The values of one PDO, whose present configuration is `now`.
fn values_of(
    model: &'static Description,
    node: NodeId,
    new: &NewPdo,
    now: &PdoConfig,
    cob_id: CobId,
) -> Result<Vec<(Mux, Vec<u8>)>, Refusal> {
    let (pdo, map) = (now.pdo, map_of(model, new)?.filter(|map| *map != now.map));
    if map.is_some() && model.pdo.fixed_mapping {
        return Err(unfit(&PdoUnfit::Fixed { model: model.name, pdo }));
    }
    let keeps_map = map.is_none();
    let mut config = PdoConfig::new(pdo, map.unwrap_or_default());
    config.transmission = new.transmission.map_or(now.transmission, TransmissionType);
    config.inhibit_time = time(pdo, "an inhibit time", new.inhibit_ms)?;
    config.event_time = time(pdo, "an event timer", new.event_ms)?;
    let mut values = config.values(model, node).map_err(|error| unfit(&error))?;
    let identifier = Mux::new(pdo.parameter_index(), 1);
    values.retain(|(object, _)| *object != identifier && !(keeps_map && object.index == pdo.mapping_index()));
    let wanted = cob_id_of(new, pdo, cob_id)?;
    if wanted != cob_id {
        if model.row(identifier).is_none_or(|row| !row.access.is_writable()) {
            let text = format!("{pdo}: the COB-ID of a {} can only be read", model.name);
            return Err(("unfit_pdo", text));
        }
        values.push((identifier, wanted.0.to_le_bytes().to_vec()));
    }
    Ok(values)
}

fn map_of(model: &'static Description, new: &NewPdo) -> Result<Option<PdoMap>, Refusal> {
    let Some(entries) = &new.objects else { return Ok(None) };
    let record = |NewEntry { object, bits }: &NewEntry| Ok(MappingRecord { mux: mapped(model, object)?, bits: *bits });
    entries.iter().map(record).collect::<Result<_, _>>().map(|records| Some(PdoMap(records)))
}

/// An object of the description, or a data type whose bits the model skips (CiA 301, 7.4.7.1).
fn mapped(model: &'static Description, text: &str) -> Result<Mux, Refusal> {
    match object(text) {
        Ok(ObjectArg::Mux(mux)) if model.pdo.mapping.dummy(mux).is_some() => Ok(mux),
        _ => row(model, text).map(Entry::mux),
    }
}

/// The COB-ID with another identifier, valid or not; its other flags stay as in the drive.
fn cob_id_of(new: &NewPdo, pdo: PdoId, now: CobId) -> Result<CobId, Refusal> {
    let kept = match new.id {
        Some(id) => now.0 & CobId::NO_RTR | u32::from(id),
        None => now.0 & !CobId::INVALID,
    };
    let wanted = CobId(if new.valid { kept } else { kept | CobId::INVALID });
    let refused = |why: String| Err(("bad_value", format!("{pdo}: {why}")));
    match new.id {
        Some(id) if id > 0x7FF => refused(format!("{id:X}h is not an 11-bit identifier; expected 181h to 77Fh")),
        Some(id) if CobId::standard(id).check_identifier().is_err() => {
            refused(format!("{id:03X}h is reserved for another service (CiA 301, table 41)"))
        }
        None if new.valid && wanted.can_id().raw() == 0 => refused("it has no identifier yet: set one".to_owned()),
        _ => Ok(wanted),
    }
}

fn time(pdo: PdoId, what: &str, ms: Option<f64>) -> Result<Option<Duration>, Refusal> {
    let read = |ms: f64| {
        let time = Duration::try_from_secs_f64(ms / 1e3);
        time.map_err(|_| ("bad_value", format!("{pdo}: expected {what} in ms, 0 or more, got {ms}")))
    };
    ms.map(read).transpose()
}

fn unfit(error: &PdoUnfit) -> Refusal {
    ("unfit_pdo", error.to_string())
}
