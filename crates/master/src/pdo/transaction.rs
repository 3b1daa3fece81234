//! The steps of a PDO configuration and the way back.

use std::ops::RangeInclusive;
use std::time::Duration;

use canopen::{AbortCode, CobId, Mux};

use super::config::{PdoConfig, TimerUnits, TransmissionType};
use super::error::PdoError;
use super::former::{Before, FormerPdo, NamedWrite};
use crate::core::PdoMap;
use crate::error::Error;
use crate::network::Node;
use canopen::pdo::{AddressMode, MappingRecord, PdoId};

/// Most objects in one PDO. Source: CiA 301, 7.5.2.36.
const MAX_OBJECTS: usize = 64;

enum WriteTrouble {
    Failed(&'static str, Error),
    Differs(NamedWrite, u32),
}

/// Sets the PDO up and gives its COB-ID.
pub(super) async fn apply(node: &Node, config: &PdoConfig, units: TimerUnits) -> Result<CobId, PdoError> {
    let writes = plan(node, config, units)?;
    let pdo = config.pdo;
    let failed = |step, cause| PdoError::Step { node: node.id(), pdo, step, cause, restored: true };
    let before = snapshot(node, config, &writes).await.map_err(|cause| failed("read what is there", cause))?;
    let cob_id = config.id.map_or(CobId(before.cob_id.0 & !CobId::INVALID), CobId::standard);
    let was_used = node.uses_pdo(pdo);
    match run(node, config, cob_id, before.cob_id, &writes).await {
        Ok(()) => Ok(cob_id),
        Err(trouble) => {
            let restored = restore(node, config, &before).await.is_ok();
            if restored && was_used {
                node.resume_pdo(pdo);
            }
            Err(match trouble {
                WriteTrouble::Failed(step, cause) => PdoError::Step { node: node.id(), pdo, step, cause, restored },
                WriteTrouble::Differs(NamedWrite { step, mux, raw, .. }, found) => {
                    PdoError::ReadBack { node: node.id(), pdo, mux, step, asked: raw, found, restored }
                }
            })
        }
    }
}

/// The way back to a PDO as it was [read](read), with the entries of its mapping behind the last object, up to so many `objects`: they carry
/// nothing, and another mapping writes over them. An entry that a device does not have is left out.
pub(super) async fn way_back(
    node: &Node,
    (config, cob_id): (&PdoConfig, CobId),
    objects: u8,
    units: TimerUnits,
) -> Result<Before, PdoError> {
    let mut writes = plan(node, config, units)?;
    for sub_index in config.map.0.len() as u8 + 1..=objects {
        let (step, mux) = ("put back an entry behind the last object", config.mapping(sub_index));
        match cell(node, mux).await {
            Ok(raw) => writes.insert(sub_index.into(), NamedWrite { step, mux, raw, bytes: 4 }),
            Err(Error::Aborted { .. }) => break,
            Err(cause) => {
                let (node, step) = (node.id(), "read what is there");
                return Err(PdoError::Step { node, pdo: config.pdo, step, cause, restored: true });
            }
        }
    }
    Ok(Before { cob_id, writes })
}

/// Sets a PDO up as it was, switched off if it was.
pub(super) async fn put_back(node: &Node, former: &FormerPdo) -> Result<(), Error> {
    restore(node, &former.config, &former.before).await.map_err(|trouble| match trouble {
        WriteTrouble::Failed(_, cause) => cause,
        WriteTrouble::Differs(NamedWrite { mux, raw: had, .. }, found) => {
            Error::NotPutBack { node: node.id(), mux, had, found }
        }
    })
}

/// Reads how a PDO is set up.
pub(super) async fn read(node: &Node, pdo: PdoId, units: TimerUnits) -> Result<(PdoConfig, CobId), Error> {
    let mut config = PdoConfig::new(pdo, PdoMap::default());
    let cob_id = CobId(cell(node, config.parameter(1)).await?);
    config.transmission = TransmissionType(cell(node, config.parameter(2)).await? as u8);
    let count = cell(node, config.mapping(0)).await?;
    config.multiplexed = AddressMode::from_count(count as u8);
    for sub_index in entries(count) {
        let record = cell(node, config.mapping(sub_index)).await?;
        config.map.0.push(MappingRecord::from_raw(record));
    }
    // Both timers are optional (CiA 301, 7.5.2.37).
    config.inhibit_time = cell(node, config.parameter(3)).await.ok().map(|raw| units.inhibit * raw);
    config.event_time = cell(node, config.parameter(5)).await.ok().map(|raw| units.event * raw);
    Ok((config, cob_id))
}

/// The entries of a mapping with this sub-index 00h: a multiplexed PDO has none.
pub(super) fn entries(count: u32) -> RangeInclusive<u8> {
    let is_multiplexed = AddressMode::from_count(count as u8).is_some();
    1..=if is_multiplexed { 0 } else { count.min(MAX_OBJECTS as u32) as u8 }
}

/// Everything between invalidation and validation, in the standard's order.
fn plan(node: &Node, config: &PdoConfig, units: TimerUnits) -> Result<Vec<NamedWrite>, PdoError> {
    let pdo = config.pdo;
    let (bits, objects) = (config.map.bits(), config.map.0.len());
    if bits > u64::BITS || objects > MAX_OBJECTS {
        return Err(PdoError::TooLong { node: node.id(), pdo, bits, objects });
    }
    let mut writes = vec![NamedWrite { step: "clear the mapping", mux: config.mapping(0), raw: 0, bytes: 1 }];
    for (sub_index, object) in (1..).zip(&config.map.0) {
        let mux = config.mapping(sub_index);
        writes.push(NamedWrite { step: "map an object", mux, raw: object.raw(), bytes: 4 });
    }
    writes.push(NamedWrite {
        step: "set the number of objects",
        mux: config.mapping(0),
        raw: config.multiplexed.map_or(objects as u32, |mode| mode.count().into()),
        bytes: 1,
    });
    let transmission = u32::from(config.transmission.0);
    writes.push(NamedWrite {
        step: "set the transmission type",
        mux: config.parameter(2),
        raw: transmission,
        bytes: 1,
    });
    let timers = [
        ("set the inhibit time", 3, config.inhibit_time, units.inhibit),
        ("set the event timer", 5, config.event_time, units.event),
    ];
    for (step, sub_index, time, unit) in timers {
        let Some(asked) = time else { continue };
        let raw = counts(asked, unit).ok_or(PdoError::Time { node: node.id(), pdo, asked, unit })?;
        writes.push(NamedWrite { step, mux: config.parameter(sub_index), raw: raw.into(), bytes: 2 });
    }
    Ok(writes)
}

/// A time in counts of the device's timer, rounded to the nearest; a time that is not zero never becomes zero.
pub(super) fn counts(time: Duration, unit: Duration) -> Option<u16> {
    let unit_ns = unit.as_nanos().max(1);
    let counts = (time.as_nanos() + unit_ns / 2) / unit_ns;
    u16::try_from(if time.is_zero() { 0 } else { counts.max(1) }).ok()
}

/// Reads what the writes are going to change.
async fn snapshot(node: &Node, config: &PdoConfig, writes: &[NamedWrite]) -> Result<Before, Error> {
    let cob_id = CobId(cell(node, config.parameter(1)).await?);
    let count = cell(node, config.mapping(0)).await?;
    let mut old = vec![NamedWrite { step: "clear the mapping", mux: config.mapping(0), raw: 0, bytes: 1 }];
    for sub_index in entries(count) {
        let mux = config.mapping(sub_index);
        old.push(NamedWrite { step: "map an object", mux, raw: cell(node, mux).await?, bytes: 4 });
    }
    old.push(NamedWrite { step: "set the number of objects", mux: config.mapping(0), raw: count, bytes: 1 });
    for write in writes.iter().filter(|write| write.mux.index == config.parameter(0).index) {
        old.push(NamedWrite { raw: cell(node, write.mux).await?, ..*write });
    }
    Ok(Before { cob_id, writes: old })
}

async fn run(
    node: &Node,
    config: &PdoConfig,
    cob_id: CobId,
    before: CobId,
    writes: &[NamedWrite],
) -> Result<(), WriteTrouble> {
    invalidate(node, config, before).await?;
    for write in writes {
        put(node, *write).await?;
    }
    // The first write cleared what a later one set.
    for write in &writes[1..] {
        check(node, *write).await?;
    }
    validate(node, config, cob_id).await
}

/// Sets bit 31. A device that does not let its COB-ID be written is left valid: some remap regardless.
async fn invalidate(node: &Node, config: &PdoConfig, cob_id: CobId) -> Result<(), WriteTrouble> {
    let (step, mux) = ("invalidate it (bit 31 of its COB-ID)", config.parameter(1));
    match put(node, NamedWrite { step, mux, raw: cob_id.0 | CobId::INVALID, bytes: 4 }).await {
        Err(WriteTrouble::Failed(_, Error::Aborted { code: AbortCode::READ_ONLY, .. })) => Ok(()),
        other => other,
    }
}

async fn validate(node: &Node, config: &PdoConfig, cob_id: CobId) -> Result<(), WriteTrouble> {
    let (step, mux) = ("validate it (its COB-ID without bit 31)", config.parameter(1));
    let write = NamedWrite { step, mux, raw: cob_id.0, bytes: 4 };
    match put(node, write).await {
        // It may already be what it has to be.
        Err(WriteTrouble::Failed(_, Error::Aborted { code: AbortCode::READ_ONLY, .. })) => {}
        other => other?,
    }
    check(node, write).await
}

async fn restore(node: &Node, config: &PdoConfig, before: &Before) -> Result<(), WriteTrouble> {
    invalidate(node, config, before.cob_id).await?;
    let (mapping, parameters): (Vec<NamedWrite>, Vec<NamedWrite>) =
        before.writes.iter().partition(|write| write.mux.index == config.mapping(0).index);
    // What a device has refused to write is as it was, and would be refused again.
    if differs(node, &mapping[1..]).await? {
        for write in mapping {
            put(node, write).await?;
        }
    }
    for write in parameters {
        if differs(node, &[write]).await? {
            put(node, write).await?;
        }
    }
    validate(node, config, before.cob_id).await
}

/// Whether one of these has another value.
async fn differs(node: &Node, writes: &[NamedWrite]) -> Result<bool, WriteTrouble> {
    for write in writes {
        match check(node, *write).await {
            Ok(()) => {}
            Err(WriteTrouble::Differs(..)) => return Ok(true),
            Err(failed) => return Err(failed),
        }
    }
    Ok(false)
}

async fn put(node: &Node, write: NamedWrite) -> Result<(), WriteTrouble> {
    let bytes = write.raw.to_le_bytes();
    node.download(write.mux, &bytes[..write.bytes]).await.map_err(|cause| WriteTrouble::Failed(write.step, cause))
}

async fn check(node: &Node, write: NamedWrite) -> Result<(), WriteTrouble> {
    let found = cell(node, write.mux).await.map_err(|cause| WriteTrouble::Failed(write.step, cause))?;
    // Bit 30 (no RTR) is the device's own: some keep it set whatever is written.
    let ignored = if write.mux.sub_index == 1 && write.mux.index & 0x200 == 0 { CobId::NO_RTR } else { 0 };
    if (found ^ write.raw) & !ignored == 0 { Ok(()) } else { Err(WriteTrouble::Differs(write, found)) }
}

/// An object of up to four bytes, whatever its length: devices differ in the types of PDO parameters.
async fn cell(node: &Node, mux: Mux) -> Result<u32, Error> {
    Ok(node.upload(mux).await?.raw())
}
