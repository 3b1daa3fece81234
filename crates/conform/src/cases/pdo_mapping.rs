//! PDO 21 to 33: what may be mapped, and by which procedure (CiA 301, 7.5.2.36 and 7.5.2.38).

use canopen::od::{Access, DataType, Entry, PdoMapping};
use canopen::{AbortCode, CobId, Mux, NmtCommand};

use crate::bench::{Bench, SdoResult, entry, is_mappable, refused};
use crate::case::{Case, Need, case};
use crate::finding::{Finding, Verdict, fail, not_applicable};

#[rustfmt::skip]
pub(crate) const CASES: &[Case] = &[
    case!("PDO 21", "What is mapped as delivered is in the dictionary", "CiA 301, 7.5.2.36", [], [], default_mapping),
    case!("PDO 22", "A mapping changed by the procedure", "CiA 301, 7.5.2.38", [Need::Tpdo], ["fixed_mapping"], remap),
    case!("PDO 23", "Refuse an entry while the mapping counts", "CiA 301, 7.5.2.38", [Need::Tpdo], ["fixed_mapping"], entry_while_counted),
    case!("PDO 24", "Refuse a mapping of a PDO that is valid", "CiA 301, 7.5.2.38", [Need::Tpdo], ["fixed_mapping"], remap_while_valid),
    case!("PDO 25", "Refuse more objects than there is room for", "CiA 301, 7.5.2.36", [], ["fixed_mapping"], too_many),
    case!("PDO 26", "Refuse more than 64 bits", "CiA 301, 7.5.2.36", [], ["fixed_mapping"], too_long),
    case!("PDO 27", "Map an output into a receive PDO", "CiA 301, 7.5.2.36", [Need::Rpdo], ["fixed_mapping"], output_into_rpdo),
    case!("PDO 28", "Refuse an input in a receive PDO", "CiA 301, 7.5.2.36", [Need::Rpdo], ["fixed_mapping"], input_into_rpdo),
    case!("PDO 29", "Refuse in a receive PDO what cannot be mapped", "CiA 301, 7.5.2.36", [Need::Rpdo], ["fixed_mapping"], unmappable_into_rpdo),
    case!("PDO 30", "Map an input into a transmit PDO", "CiA 301, 7.5.2.38", [Need::Tpdo], ["fixed_mapping"], input_into_tpdo),
    case!("PDO 31", "Refuse an output in a transmit PDO", "CiA 301, 7.5.2.38", [Need::Tpdo], ["fixed_mapping"], output_into_tpdo),
    case!("PDO 32", "Refuse in a transmit PDO what cannot be mapped", "CiA 301, 7.5.2.38", [Need::Tpdo], ["fixed_mapping"], unmappable_into_tpdo),
    case!("PDO 33", "Map a dummy object into a receive PDO", "CiA 301, 7.4.7.1", [Need::Rpdo], ["fixed_mapping"], dummy),
    case!("PDO 59", "Refuse to map an object that is not there", "CiA 301, 7.5.2.36", [Need::Rpdo], ["fixed_mapping"], missing_object),
    case!("PDO 60", "Refuse a mapping entry of a wrong length", "CiA 301, 7.5.2.36", [Need::Rpdo], ["fixed_mapping"], wrong_length),
];

const UNSUPPORTED: AbortCode = AbortCode::UNSUPPORTED_ACCESS;
const GENERAL: AbortCode = AbortCode::GENERAL;
const MAPPING_CODES: [AbortCode; 4] =
    [UNSUPPORTED, AbortCode::NO_SUCH_OBJECT, AbortCode::NOT_MAPPABLE, AbortCode::PDO_TOO_LONG];
/// What a device answers whose mapping cannot be changed.
const CONSTANT: [AbortCode; 2] = [AbortCode::READ_ONLY, UNSUPPORTED];

async fn default_mapping(bench: &mut Bench) -> Verdict {
    let subject = bench.subject;
    let mappings =
        subject.rows().filter(|row| matches!(row.index, 0x1600..=0x17FF | 0x1A00..=0x1BFF) && row.sub_index > 0);
    let mut checked = 0;
    for row in mappings {
        let Some(data) = subject.default_of(row) else { continue };
        let raw = data.iter().rev().fold(0_u32, |raw, byte| raw << 8 | u32::from(*byte));
        let mux = Mux::new((raw >> 16) as u16, (raw >> 8) as u8);
        if raw == 0 || mux.index < 0x20 {
            continue;
        }
        if subject.description.row(mux).is_none() {
            fail!("{} maps {mux}, which the description does not have", row.mux());
        }
        match bench.upload(mux).await? {
            Ok(_) | Err(AbortCode::WRITE_ONLY) => checked += 1,
            Err(code) => fail!("{} maps {mux}, which is answered with {code}", row.mux()),
        }
    }
    Ok(format!("{checked} mapped objects are there"))
}

/// The first PDO of a direction, off, with an empty mapping; `None` if its mapping is constant.
async fn emptied(bench: &mut Bench, base: u16) -> Result<u16, Finding> {
    bench.nmt(NmtCommand::EnterPreOperational).await;
    let Some(index) = bench.subject.pdos(base).next() else { not_applicable!("the device has no such PDO") };
    bench.switch_off(index).await?;
    if let Err(code) = bench.try_write(Mux::new(index + 0x200, 0), &[0]).await? {
        end_if_constant(bench, index, code)?;
        fail!("{:04X}h:00 does not take 0 while the PDO is off: {code}", index + 0x200);
    }
    Ok(index)
}

/// Ends a case if the device has refused what is read only by its description: whether mappings can be changed is up to the device
/// (CiA 301, 7.5.2.36 and 7.5.2.38).
pub(super) fn end_if_constant(bench: &Bench, index: u16, code: AbortCode) -> Result<(), Finding> {
    if !CONSTANT.contains(&code) || is_writable(bench, index) {
        return Ok(());
    }
    if bench.subject.departures().any(|departure| departure.key() == "fixed_mapping") {
        fail!("the mapping cannot be changed: {code}");
    }
    let source = if bench.subject.by_manual { "the manual" } else { "the file" };
    not_applicable!("{source} has {:04X}h:00 as read only: its mapping is fixed", index + 0x200)
}

fn is_writable(bench: &Bench, index: u16) -> bool {
    bench.subject.row(index + 0x200, 0).is_some_and(|row| row.access.is_writable())
}

async fn remap(bench: &mut Bench) -> Verdict {
    let index = emptied(bench, 0x1800).await?;
    let Some(row) = bench.mappable(PdoMapping::Transmit) else { not_applicable!("no object can be mapped") };
    let mapping = index + 0x200;
    if let Err(code) = bench.map(index, &[entry(row)]).await? {
        fail!("{} cannot be mapped into {mapping:04X}h: {code}", row.mux());
    }
    let (count, first) = (bench.number(Mux::new(mapping, 0)).await?, bench.number(Mux::new(mapping, 1)).await? as u32);
    if count != 1 || first != entry(row) {
        fail!("{mapping:04X}h has {count} entries, the first {first:08X}h; expected 1 and {:08X}h", entry(row));
    }
    Ok(format!("{mapping:04X}h maps {}", row.mux()))
}

async fn entry_while_counted(bench: &mut Bench) -> Verdict {
    let index = emptied(bench, 0x1800).await?;
    let Some(row) = bench.mappable(PdoMapping::Transmit) else { not_applicable!("no object can be mapped") };
    if let Err(code) = bench.map(index, &[entry(row)]).await? {
        fail!("{} cannot be mapped: {code}", row.mux());
    }
    // Another object than the one that is there: writing the same would change nothing.
    let others =
        || bench.subject.rows().filter(|other| is_mappable(other, PdoMapping::Transmit) && other.mux() != row.mux());
    let Some(other) = others().next() else { not_applicable!("one object only can be mapped") };
    let answer = bench.try_write(Mux::new(index + 0x200, 1), &entry(other).to_le_bytes()).await?;
    let codes = [UNSUPPORTED, AbortCode::NOT_MAPPABLE, AbortCode::DEVICE_STATE, GENERAL];
    refused("an entry written while sub-index 00h is not 0", &answer, &codes)
}

async fn remap_while_valid(bench: &mut Bench) -> Verdict {
    let index = emptied(bench, 0x1800).await?;
    let Some(row) = bench.mappable(PdoMapping::Transmit) else { not_applicable!("no object can be mapped") };
    if let Err(code) = bench.map(index, &[entry(row)]).await? {
        fail!("{} cannot be mapped: {code}", row.mux());
    }
    let cob = bench.number(Mux::new(index, 1)).await? as u32;
    bench.switch_on(index, can::CanId::standard((cob & 0x7FF) as u16)).await?;
    if bench.number(Mux::new(index, 1)).await? as u32 & CobId::INVALID != 0 {
        not_applicable!("the PDO cannot be made valid");
    }
    let answer = bench.try_write(Mux::new(index + 0x200, 0), &[0]).await?;
    if answer.is_ok() && bench.subject.by_manual && bench.subject.description.pdo.remap_while_valid {
        not_applicable!("the maker's manual lets the mapping of a valid PDO be changed");
    }
    let codes = [UNSUPPORTED, AbortCode::NOT_MAPPABLE, AbortCode::DEVICE_STATE, GENERAL];
    refused("sub-index 00h written while the PDO is valid", &answer, &codes)
}

async fn too_many(bench: &mut Bench) -> Verdict {
    let base = if bench.subject.pdos(0x1800).next().is_some() { 0x1800 } else { 0x1400 };
    let index = emptied(bench, base).await?;
    let room = bench.subject.rows().filter(|row| row.index == index + 0x200 && row.sub_index > 0).count();
    let answer = bench.try_write(Mux::new(index + 0x200, 0), &[room as u8 + 1]).await?;
    let codes = [MAPPING_CODES.as_slice(), &[AbortCode::INVALID_VALUE, AbortCode::VALUE_TOO_HIGH, GENERAL]].concat();
    refused(&format!("{} objects where there is room for {room}", room + 1), &answer, &codes)
}

async fn too_long(bench: &mut Bench) -> Verdict {
    let base = if bench.subject.pdos(0x1800).next().is_some() { 0x1800 } else { 0x1400 };
    let direction = if base == 0x1800 { PdoMapping::Transmit } else { PdoMapping::Receive };
    let index = emptied(bench, base).await?;
    let rows: Vec<_> = bench.subject.rows().filter(|row| is_mappable(row, direction)).collect();
    let Some(longest) = rows.iter().max_by_key(|row| row.data_type.bits()) else {
        not_applicable!("no object can be mapped")
    };
    let needed = 64 / usize::from(longest.data_type.bits()) + 1;
    let room = bench.subject.rows().filter(|row| row.index == index + 0x200 && row.sub_index > 0).count();
    if room < needed {
        not_applicable!("the mapping has room for {room} objects, which never are longer than 64 bits");
    }
    let answer = bench.map(index, &vec![entry(longest); needed]).await?;
    let codes = [MAPPING_CODES.as_slice(), &[GENERAL]].concat();
    refused(&format!("{needed} objects of {} bits", longest.data_type.bits()), &answer, &codes)
}

/// Maps one object into the first PDO of a direction.
async fn map_one(bench: &mut Bench, base: u16, raw: u32) -> Result<SdoResult<()>, Finding> {
    let index = emptied(bench, base).await?;
    bench.map(index, &[raw]).await
}

fn first(bench: &Bench, wanted: impl Fn(&Entry) -> bool) -> Option<&'static Entry> {
    bench
        .subject
        .rows()
        .find(|row| wanted(row) && matches!(row.data_type.bits(), 8 | 16 | 32) && row.data_type != DataType::Boolean)
}

async fn output_into_rpdo(bench: &mut Bench) -> Verdict {
    let Some(row) = first(bench, |row| is_mappable(row, PdoMapping::Receive)) else {
        not_applicable!("no object is an output that can be mapped")
    };
    accepted(bench, 0x1400, row).await
}

async fn input_into_tpdo(bench: &mut Bench) -> Verdict {
    let Some(row) = first(bench, |row| is_mappable(row, PdoMapping::Transmit)) else {
        not_applicable!("no object is an input that can be mapped")
    };
    accepted(bench, 0x1800, row).await
}

async fn accepted(bench: &mut Bench, base: u16, row: &Entry) -> Verdict {
    match map_one(bench, base, entry(row)).await? {
        Ok(()) => Ok(format!("{} is mapped", row.mux())),
        Err(code) => fail!("{} ({}) cannot be mapped: {code}", row.mux(), row.access.name()),
    }
}

const NOT_THERE: [AbortCode; 3] = [AbortCode::NO_SUCH_OBJECT, AbortCode::NOT_MAPPABLE, GENERAL];

async fn input_into_rpdo(bench: &mut Bench) -> Verdict {
    let input = |row: &Entry| row.pdo.is_allowed() && (row.pdo == PdoMapping::Transmit || !row.access.is_writable());
    let Some(row) = first(bench, input) else { not_applicable!("no object is an input that can be mapped") };
    let answer = map_one(bench, 0x1400, entry(row)).await?;
    refused(&format!("{} ({}) in a receive PDO", row.mux(), row.access.name()), &answer, &NOT_THERE)
}

async fn output_into_tpdo(bench: &mut Bench) -> Verdict {
    let output =
        |row: &Entry| row.pdo == PdoMapping::Receive || row.pdo.is_allowed() && row.access == Access::WriteOnly;
    let Some(row) = first(bench, output) else { not_applicable!("no object is an output only that can be mapped") };
    let answer = map_one(bench, 0x1800, entry(row)).await?;
    refused(&format!("{} ({}) in a transmit PDO", row.mux(), row.access.name()), &answer, &NOT_THERE)
}

async fn unmappable(bench: &mut Bench, base: u16) -> Verdict {
    let Some(row) = first(bench, |row| !row.pdo.is_allowed()) else { not_applicable!("every object can be mapped") };
    let answer = map_one(bench, base, entry(row)).await?;
    refused(&format!("{}, which cannot be mapped", row.mux()), &answer, &NOT_THERE)
}

async fn unmappable_into_rpdo(bench: &mut Bench) -> Verdict {
    unmappable(bench, 0x1400).await
}

async fn unmappable_into_tpdo(bench: &mut Bench) -> Verdict {
    unmappable(bench, 0x1800).await
}

async fn dummy(bench: &mut Bench) -> Verdict {
    // UNSIGNED8, 0005h.
    match map_one(bench, 0x1400, 0x0005_0008).await? {
        Ok(()) => Ok("dummy 0005h (8 bits) is mapped".into()),
        Err(code @ (AbortCode::NO_SUCH_OBJECT | AbortCode::NOT_MAPPABLE)) => {
            not_applicable!("the device has no dummy mapping: {code}")
        }
        Err(code) => fail!(
            "0005h cannot be mapped: {code}; expected {} of a device without dummy mapping",
            AbortCode::NO_SUCH_OBJECT
        ),
    }
}

async fn missing_object(bench: &mut Bench) -> Verdict {
    let answer = map_one(bench, 0x1400, 0x5FFE_0008).await?;
    refused("5FFEh, which is not there, in a receive PDO", &answer, &NOT_THERE)
}

async fn wrong_length(bench: &mut Bench) -> Verdict {
    let Some(row) = first(bench, |row| is_mappable(row, PdoMapping::Receive) && row.data_type.bits() < 32) else {
        not_applicable!("no object shorter than 32 bits can be mapped");
    };
    let raw = (entry(row) & !0xFF) | (u32::from(row.data_type.bits()) - 1);
    let answer = map_one(bench, 0x1400, raw).await?;
    let codes = [
        AbortCode::NOT_MAPPABLE,
        AbortCode::LENGTH_MISMATCH,
        AbortCode::PDO_TOO_LONG,
        AbortCode::PARAMETER_INCOMPATIBLE,
        GENERAL,
    ];
    refused(
        &format!("{} bits of {}, which has {}", row.data_type.bits() - 1, row.mux(), row.data_type.bits()),
        &answer,
        &codes,
    )
}
