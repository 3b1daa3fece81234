//! How a drive comes to send what is asked for: which of its spare TPDOs carry it, and what makes them come. Pure: no node is asked.
//!
//! In: the model's PDO rules, how its PDOs are set up, what is asked for, how fast, and what the bus has (bit rate, SYNC). Out: the
//! configuration of some TPDOs with the values of their objects, or why there is none and what is possible instead.
//!
//! A TPDO is spare when nothing can come of it: it is off, it carries nothing, or it waits for a SYNC that is not sent. One that is in
//! use is taken only where the caller names it.

use std::collections::BTreeMap;
use std::time::Duration;

use can::Bitrate;
use canopen::pdo::{Direction, EventTrigger, MappingRecord, PdoId};
use canopen::{CobId, Mux, NodeId};
use devices::Description;
use master::core::PdoMap;
use master::pdo::{PdoConfig, PdoUnfit, TimerUnits, TransmissionType, most_objects, record_of, values_off};
use master::plan::{HostQueue, NodeTraffic, PlannedFrame, Purpose, Settings, plan as plan_bus};
use words::counted;
use words::failure::Failure;

/// A TPDO as it is set up.
type ConfiguredTpdo = (PdoConfig, CobId);

/// The bits of a PDO (CiA 301, 7.2.2.5).
const BITS: u32 = u64::BITS;

/// Periods that are offered where the one that is asked for is too short for the bus.
const PERIODS_MS: [u64; 9] = [1, 2, 5, 10, 20, 50, 100, 200, 500];

/// Time between two SDO requests for which there has to be room: what a capture writes leads back within a few seconds then.
const SDO_PERIOD: Duration = Duration::from_millis(100);

/// What is asked of a drive.
#[derive(Clone, Debug)]
pub struct Request<'a> {
    /// The objects.
    pub objects: &'a [Mux],
    /// Time between two readings.
    pub period: Duration,
    /// Of the bus.
    pub bitrate: Bitrate,
    /// The period of SYNC where it is on the bus.
    pub sync: Option<Duration>,
    /// TPDOs that are taken although they are in use.
    pub take: &'a [PdoId],
}

/// What makes the TPDOs come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// Their event timer.
    EventTimer,
    /// Every so many of the SYNCs that are on the bus.
    Sync(u8),
    /// A SYNC that this master sends meanwhile.
    OwnSync,
}

impl Pace {
    /// In words, for a report.
    pub fn words(self) -> String {
        match self {
            Self::EventTimer => "event timer".to_owned(),
            Self::Sync(1) => "SYNC".to_owned(),
            Self::Sync(every) => format!("every {every}. SYNC"),
            Self::OwnSync => "SYNC sent for the capture".to_owned(),
        }
    }
}

/// How the drive is made to send.
#[derive(Clone, Debug, PartialEq)]
pub struct CapturePlan {
    /// The TPDOs as they will be, with their identifiers.
    pub pdos: Vec<(PdoConfig, u16)>,
    /// What makes them come.
    pub pace: Pace,
    /// Time between two of each.
    pub period: Duration,
    /// The values that lead there.
    pub values: BTreeMap<Mux, Vec<u8>>,
    /// Share of the bus's time that this node's TPDOs and SYNC then take, all together.
    pub load: f64,
}

/// Plans it.
///
/// # Errors
/// What is in the way, and what is possible instead.
pub fn plan(
    model: &'static Description,
    node: NodeId,
    now: &[(PdoConfig, CobId)],
    request: &Request<'_>,
) -> Result<CapturePlan, Failure> {
    let refused = |what: String| Failure::new(format!("node {node}: {what}")).at_node(node);
    let records = records(model, request.objects).map_err(|(what, reasons)| {
        let failure = refused(what).of_kind("no_mapping");
        let failure = reasons.iter().fold(failure, Failure::because);
        failure.next("--sdo reads these by SDO, one after the other: slower, and at times of their own")
    })?;
    let tpdos: Vec<&(PdoConfig, CobId)> =
        now.iter().filter(|(config, _)| config.pdo.direction == Direction::Tpdo).collect();
    let (spare, in_use): (Vec<_>, Vec<_>) = tpdos.into_iter().partition(|tpdo| is_spare(tpdo, request));
    let paces = paces(model, request);
    if paces.is_empty() {
        return Err(no_pace(model, request, refused));
    }
    let mut room = Ok(());
    for pace in paces {
        // Where a TPDO does not take this pace, another may, or another pace.
        let suited: Vec<SpareTpdo> =
            spare.iter().filter_map(|tpdo| SpareTpdo::new(model, node, tpdo, pace, request)).collect();
        let count = suited.len();
        match packed(&records, suited) {
            Ok(slots) => return on_the_bus(model, node, (now, &spare), request, pace, &slots, &refused),
            Err(left) => room = Err((left, count)),
        }
    }
    let (left, spare) = room.err().unwrap_or_default();
    Err(no_room(model, &records, &left, spare, &in_use, refused))
}

/// The mapping records of the objects, or which of them cannot be mapped and why.
fn records(model: &Description, objects: &[Mux]) -> Result<Vec<MappingRecord>, (String, Vec<String>)> {
    let first = PdoId { direction: Direction::Tpdo, number: canopen::pdo::PdoNumber::FIRST };
    if model.pdo.fixed_mapping {
        let why = format!("the mapping of a {} is fixed ({})", model.name, model.manual);
        return Err(("its TPDOs cannot be mapped".to_owned(), vec![why]));
    }
    let (mut records, mut wrong) = (Vec::new(), Vec::new());
    for object in objects {
        match record_of(model, first, *object) {
            Ok(record) if records.contains(&record) => {}
            Ok(record) => records.push(record),
            Err(PdoUnfit::NotMappable { object, name, why, .. }) => wrong.push(format!("{object} {name}: {why}")),
            Err(other) => wrong.push(other.to_string()),
        }
    }
    if wrong.is_empty() { Ok(records) } else { Err(("not everything can be mapped into a TPDO".to_owned(), wrong)) }
}

fn is_spare((config, cob_id): &(PdoConfig, CobId), request: &Request<'_>) -> bool {
    !cob_id.is_valid()
        || config.is_empty()
        || config.transmission.is_synchronous() && request.sync.is_none()
        || request.take.contains(&config.pdo)
}

/// Ways to have TPDOs come with this period, the best first: what is on the bus anyway, what the drive does by itself where that is
/// exact, and a SYNC of this master, to which every other synchronous PDO of the bus answers too.
fn paces(model: &Description, request: &Request<'_>) -> Vec<Pace> {
    let mut paces = Vec::new();
    if let Some(sync) = request.sync.filter(|sync| !sync.is_zero()) {
        let every = request.period.as_nanos() / sync.as_nanos();
        if request.period.as_nanos().is_multiple_of(sync.as_nanos()) && (1..=240).contains(&every) {
            paces.push(Pace::Sync(every as u8));
        }
    }
    let unit = TimerUnits::of(model).event;
    let divides = request.period.as_nanos().is_multiple_of(unit.as_nanos().max(1));
    let own = request.sync.is_none().then_some(Pace::OwnSync);
    match model.pdo.event_trigger {
        EventTrigger::ChangeOr255ByTimer => paces.extend(divides.then_some(Pace::EventTimer).into_iter().chain(own)),
        // One that sends on change too is held back by its inhibit time, which counts from the end of the last frame.
        EventTrigger::Change => paces.extend(own.into_iter().chain(divides.then_some(Pace::EventTimer))),
        EventTrigger::AnswersRpdo => paces.extend(own),
    }
    paces
}

fn no_pace(model: &Description, request: &Request<'_>, refused: impl Fn(String) -> Failure) -> Failure {
    let asked = request.period;
    let unit = TimerUnits::of(model).event;
    let failure = refused(format!("a reading every {asked:?} cannot be had")).of_kind("no_rate");
    let failure = match request.sync {
        Some(sync) => failure
            .because(format!("SYNC comes every {sync:?}, which does not divide it"))
            .next(format!("give a multiple of {sync:?}: --rate {:?}", nearest(asked, sync))),
        None => failure,
    };
    let failure = failure.because(format!("the event timers of a {} count {unit:?}", model.name));
    failure.next(format!("give a multiple of {unit:?}: --rate {:?}", nearest(asked, unit)))
}

/// The multiple of `step` next to a time, at least one.
fn nearest(time: Duration, step: Duration) -> Duration {
    let times = (time.as_secs_f64() / step.as_secs_f64()).round().max(1.0);
    step * times.min(f64::from(u16::MAX)) as u32
}

/// A spare TPDO, and what has been put into it.
#[derive(Clone, Debug)]
struct SpareTpdo {
    config: PdoConfig,
    cob_id: CobId,
    most: usize,
}

impl SpareTpdo {
    /// `None` where it does not take this pace, or has no identifier.
    fn new(
        model: &'static Description,
        node: NodeId,
        (config, cob_id): &(PdoConfig, CobId),
        pace: Pace,
        request: &Request<'_>,
    ) -> Option<Self> {
        let mut new = PdoConfig::new(config.pdo, PdoMap::default());
        new.id = cob_id.can_id().as_standard().filter(|id| cob_id.is_valid() && *id != 0);
        match pace {
            Pace::Sync(every) => new.transmission = TransmissionType(every),
            Pace::OwnSync => new.transmission = TransmissionType::EVERY_SYNC,
            Pace::EventTimer => {
                new.event_time = Some(request.period);
                // By its timer alone, or also on change: then not more often than that.
                let by_change = model.pdo.event_trigger == EventTrigger::Change;
                let had = config.inhibit_time.filter(|time| !time.is_zero());
                new.inhibit_time = if by_change { Some(request.period) } else { had.map(|_| Duration::ZERO) };
            }
        }
        if pace != Pace::EventTimer {
            // An inhibit time would hold back what SYNC asks for.
            new.inhibit_time = config.inhibit_time.filter(|time| !time.is_zero()).map(|_| Duration::ZERO);
        }
        let values = new.values(model, node).ok()?;
        let (_, after) = config.with_values(*cob_id, &values.into_iter().collect(), model);
        let has_id = after.is_valid() && after.can_id().as_standard().is_some_and(|id| id != 0);
        has_id.then(|| Self { most: most_objects(model, new.pdo), config: new, cob_id: after })
    }

    fn takes(&self, record: &MappingRecord) -> bool {
        self.config.map.0.len() < self.most && self.config.map.bits() + u32::from(record.bits) <= BITS
    }
}

/// Puts the records into as few TPDOs as they take, the longest first; or those that have no place.
fn packed(records: &[MappingRecord], mut slots: Vec<SpareTpdo>) -> Result<Vec<SpareTpdo>, Vec<MappingRecord>> {
    let mut longest_first = records.to_vec();
    longest_first.sort_by_key(|record| std::cmp::Reverse(record.bits));
    let mut left = Vec::new();
    for record in longest_first {
        match slots.iter_mut().find(|slot| slot.takes(&record)) {
            Some(slot) => slot.config.map.0.push(record),
            None => left.push(record),
        }
    }
    slots.retain(|slot| !slot.config.map.0.is_empty());
    if left.is_empty() { Ok(slots) } else { Err(left) }
}

fn no_room(
    model: &'static Description,
    records: &[MappingRecord],
    left: &[MappingRecord],
    spare: usize,
    in_use: &[&(PdoConfig, CobId)],
    refused: impl Fn(String) -> Failure,
) -> Failure {
    let named = |record: &MappingRecord| {
        let name = model.row(record.mux).map_or_else(String::new, |row| format!(" {}", row.name));
        format!("{}{name} ({} bits)", record.mux, record.bits)
    };
    let list = |records: &[MappingRecord]| records.iter().map(named).collect::<Vec<_>>().join(", ");
    let mut failure = refused(format!("its spare TPDOs have no room for {}", list(left)))
        .of_kind("no_room")
        .because(format!("{spare} TPDOs are spare, of {BITS} bits and {} objects at most each", model.pdo.max_objects));
    for (config, _) in in_use {
        let carries = config.map.0.iter().map(|record| record.mux.to_string()).collect::<Vec<_>>().join(" ");
        failure = failure.because(format!("{} is in use: it carries {carries}, {}", config.pdo, config.when()));
    }
    let fit: Vec<_> = records.iter().filter(|record| !left.contains(record)).copied().collect();
    if !fit.is_empty() {
        failure = failure.next(format!("these have room: {}", list(&fit)));
    }
    if let Some((config, _)) = in_use.first() {
        let name = config.pdo.to_string().to_lowercase();
        failure = failure.next(format!("--take {name} uses it too; who listens to it misses it meanwhile"));
    }
    failure.next("--sdo reads what has no room by SDO: slower, and at times of its own")
}

/// Whether the bus carries it, and the plan.
fn on_the_bus(
    model: &'static Description,
    node: NodeId,
    (now, spare): (&[ConfiguredTpdo], &[&ConfiguredTpdo]),
    request: &Request<'_>,
    pace: Pace,
    slots: &[SpareTpdo],
    refused: &impl Fn(String) -> Failure,
) -> Result<CapturePlan, Failure> {
    let mut values = BTreeMap::new();
    for slot in slots {
        let unfit = |error: PdoUnfit| refused(error.to_string()).of_kind("no_mapping");
        values.extend(slot.config.values(model, node).map_err(unfit)?);
    }
    // A SYNC that is sent for the capture is not to bring TPDOs that did not come before.
    let is_asked_for = |pdo: PdoId| slots.iter().any(|slot| slot.config.pdo == pdo);
    for (config, cob_id) in spare.iter().filter(|_| pace == Pace::OwnSync) {
        let waits = cob_id.is_valid() && config.transmission.is_synchronous() && !config.map.0.is_empty();
        if waits && !is_asked_for(config.pdo) {
            values.extend(values_off(model, config.pdo, node).unwrap_or_default());
        }
    }
    let load = |period: Duration| bus_with(model, node, now, &values, (request, pace, period), is_asked_for);
    let (fits, share) = load(request.period);
    if !fits {
        let mut longer = PERIODS_MS.map(Duration::from_millis).into_iter().filter(|period| *period > request.period);
        let slower = longer.find(|period| load(*period).0);
        let failure = refused(format!("the bus is too slow for a reading every {:?}", request.period))
            .of_kind("bus_too_slow")
            .because(format!(
                "{} with {} would take {:.0} % of {} kbit/s",
                counted(slots.len(), "TPDO"),
                counted(slots.iter().map(|slot| slot.config.map.0.len()).sum::<usize>(), "object"),
                share * 100.0,
                request.bitrate.bits_per_second() / 1000
            ))
            .because("SDO, by which everything is put back, and EMCY have to have room beside them");
        let failure = slower.into_iter().fold(failure, |failure, period| {
            failure.next(format!("every {period:?} is possible with all of them: --rate {period:?}"))
        });
        return Err(failure.next("ask for fewer quantities; --bitrate says how fast the bus is, if that is another"));
    }
    let pdos = slots.iter().filter_map(|slot| Some((slot.config.clone(), slot.cob_id.can_id().as_standard()?)));
    Ok(CapturePlan { pdos: pdos.collect(), pace, period: request.period, values, load: share })
}

/// Whether the bus carries this node's PDOs with these values, and the share of its time that its TPDOs and SYNC take.
fn bus_with(
    model: &'static Description,
    node: NodeId,
    now: &[ConfiguredTpdo],
    values: &BTreeMap<Mux, Vec<u8>>,
    (request, pace, period): (&Request<'_>, Pace, Duration),
    is_asked_for: impl Fn(PdoId) -> bool,
) -> (bool, f64) {
    let timed = |config: &mut PdoConfig| {
        if pace == Pace::EventTimer && is_asked_for(config.pdo) {
            config.event_time = Some(period);
            config.inhibit_time = Some(period);
        }
    };
    let pdos = now.iter().filter(|(config, _)| config.pdo.direction == Direction::Tpdo).map(|(config, cob_id)| {
        let (mut config, cob_id) = config.with_values(*cob_id, values, model);
        timed(&mut config);
        (config, cob_id)
    });
    let event_trigger = model.pdo.event_trigger;
    let (emcy, timing) = (model.sends_emcy(), model.timing);
    let traffic =
        NodeTraffic { node, pdos: pdos.collect(), in_cycle: None, event_trigger, heartbeat: None, emcy, timing };
    let own = (pace == Pace::OwnSync).then_some(period);
    let sync = own.or(match pace {
        Pace::Sync(every) => Some(period / u32::from(every)),
        Pace::OwnSync | Pace::EventTimer => request.sync,
    });
    let new = Settings::new(sync.unwrap_or(period));
    let with_sdo = Settings { has_sync: sync.is_some(), sdo: Some(SDO_PERIOD), queue: HostQueue::Priority, ..new };
    let planned = |settings: Settings| plan_bus(std::slice::from_ref(&traffic), &settings, request.bitrate);
    // Everything is put back by SDO, whose identifiers are less urgent than those of all PDOs. What it delays is jitter, and shown.
    let (alone, whole) = (planned(with_sdo.cycle_alone()), planned(with_sdo));
    let mut sdo = whole.frames.iter().filter(|frame| matches!(frame.purpose, Purpose::SdoRequest | Purpose::SdoAnswer));
    (alone.fits() && whole.load < 1.0 && sdo.all(PlannedFrame::is_in_time), alone.load)
}

#[cfg(test)]
#[path = "plan_tests.rs"]
mod tests;
