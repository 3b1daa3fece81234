//! Descriptions of devices that files describe.

use std::collections::{HashMap, HashSet};
use std::fmt;
use std::hash::{BuildHasher, RandomState};
use std::sync::{LazyLock, Mutex, PoisonError};

use can::Bitrate;
use canopen::object::CONSUMER_HEARTBEAT_TIME_1;
use canopen::od::{DefaultValue, Entry, FREE_PLACES, MAX_ROWS, RowFacts, Table, TableError};
use canopen::{Mux, NodeId};
use cia402::ErrorCode;
use cia402::object::{MAX_PROFILE_VELOCITY, MAX_TORQUE, PROFILE_VELOCITY, TARGET_TORQUE, TARGET_VELOCITY};
use devices::faults::Faults;
use devices::{Description, HostWatch, Identity, NmtRules, ParameterStorage, PdoRules, Timing, servo};

use super::axis::{BLOCK, axes, say_modes};
use super::names;
use super::rows::{DraftRow, leak, rows};
use crate::Eds;

/// All descriptions that were made of files, by a fingerprint of what the files say: one for each place that such a file
/// came from.
static KEPT: LazyLock<Mutex<Cache>> = LazyLock::new(Mutex::default);

#[derive(Default)]
struct Cache {
    /// Two keys of this program's run, so that no file can be made to look like another.
    keys: [RandomState; 2],
    descriptions: HashMap<Fingerprint, Vec<&'static Description>>,
}

/// Two hashes of 64 bits.
type Fingerprint = [u64; 2];

impl Cache {
    fn fingerprint(&self, eds: &Eds) -> Fingerprint {
        self.keys.each_ref().map(|key| key.hash_one(eds))
    }
}

/// The description of the device that a file describes, kept for the life of the program: the same file, or another that
/// says the same, gives the same one. As its document it names the file as the file names itself; [`keep_of`] names it as the
/// user does.
///
/// An axis has what the file has of CiA 402, in the units and with the error codes of the standard; what is stored and where the
/// device departs from the standard is not in a file. Of a DCF the values stand in place of the defaults.
///
/// # Errors
/// If there is no object in the file, or more of them than a dictionary holds.
pub fn keep(eds: &Eds) -> Result<&'static Description, Unkept> {
    match eds.file.file_name.trim() {
        "" => keep_named(eds, "a file without a name"),
        name => keep_named(eds, &format!("the file {name}")),
    }
}

/// As [`keep`], of a file that the user has called so: its path, as a rule.
///
/// # Errors
/// As [`keep`].
pub fn keep_of(eds: &Eds, file: &str) -> Result<&'static Description, Unkept> {
    keep_named(eds, &format!("the file {file}"))
}

fn keep_named(eds: &Eds, file: &str) -> Result<&'static Description, Unkept> {
    let manual = &if eds.has_modules() { format!("{file}, without its modules") } else { file.to_owned() };
    // A panic while it was locked has left the map as it was.
    let mut all = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let fingerprint = all.fingerprint(eds);
    let kept = all.descriptions.get(&fingerprint).map_or(&[][..], Vec::as_slice);
    if let Some(known) = kept.iter().find(|known| known.manual == manual) {
        return Ok(known);
    }
    let description = match kept.first() {
        // All but the name is shared.
        Some(known) => Description { manual: leak(manual.to_owned()), sections: &[], ..**known },
        None => describe(eds, manual)?,
    };
    let description: &'static Description = Box::leak(Box::new(description));
    all.descriptions.entry(fingerprint).or_default().push(description);
    Ok(description)
}

/// Why a file makes no description.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unkept {
    /// It has no objects.
    NoObjects,
    /// It has more objects and sub-objects than a dictionary holds.
    TooManyRows {
        /// So many.
        rows: usize,
        /// It holds so many.
        most: usize,
    },
    /// They make no table.
    Rows(TableError),
}

impl fmt::Display for Unkept {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoObjects => write!(f, "the file has no objects; `ferrodrive eds lint` says why"),
            Self::Rows(error) => write!(f, "the objects of the file make no dictionary: {error}"),
            Self::TooManyRows { rows, most } => write!(
                f,
                "the file has {rows} objects and sub-objects, more than the {most} of a dictionary; take those out that are not needed"
            ),
        }
    }
}

impl std::error::Error for Unkept {}

/// Targets whose effect another object of the axis holds back, which has their unit (CiA 402-2, max torque, max profile velocity).
const HELD_BACK: [(Mux, Mux); 3] =
    [(TARGET_TORQUE, MAX_TORQUE), (PROFILE_VELOCITY, MAX_PROFILE_VELOCITY), (TARGET_VELOCITY, MAX_PROFILE_VELOCITY)];

/// Says of the rows of each axis by which object they are held back, where the device has that.
fn say_limits(rows: &mut [DraftRow]) {
    let there: HashSet<Mux> = rows.iter().map(|row| row.entry.mux()).collect();
    for row in rows.iter_mut().filter(|row| (0x6000..0x8000).contains(&row.entry.index)) {
        let block = (row.entry.index - 0x6000) / BLOCK * BLOCK;
        let held =
            HELD_BACK.iter().find(|(of, _)| (of.index + block, of.sub_index) == (row.entry.index, row.entry.sub_index));
        if let Some((_, by)) = held
            && there.contains(&Mux::new(by.index + block, by.sub_index))
        {
            row.entry = row.entry.held_to(by.index + block, by.sub_index, 1);
        }
    }
}

fn describe(eds: &Eds, manual: &str) -> Result<Description, Unkept> {
    let count = eds.variables().count();
    match count {
        0 => return Err(Unkept::NoObjects),
        rows if rows > MAX_ROWS => return Err(Unkept::TooManyRows { rows, most: MAX_ROWS }),
        _ => {}
    }
    let mut rows = rows(eds);
    say_modes(&mut rows);
    say_limits(&mut rows);
    say_identity(eds, &mut rows);
    let table = table(rows)?;
    let identity = identity(eds, table);
    let axes: &'static [_] = Box::leak(axes(table, identity.device_type).into_boxed_slice());
    let has = |index, sub_index| table.find(Mux::new(index, sub_index)).is_ok();
    let watches = !axes.is_empty() && has(0x1016, 1);
    Ok(Description {
        name: leak(name(eds)),
        title: leak(title(eds)),
        manual: leak(manual.to_owned()),
        sections: &[],
        identity,
        distinguishing_object: None,
        dictionary: table,
        node_id: eds.commissioning.as_ref().and_then(|of| of.node_id).and_then(NodeId::new),
        bitrate: eds.commissioning.as_ref().and_then(|of| of.bit_rate).and_then(|k| Bitrate::new(u32::from(k) * 1_000)),
        axes,
        host_watch: if watches {
            HostWatch::Heartbeat { consumer: CONSUMER_HEARTBEAT_TIME_1, fault: ErrorCode::LIFE_GUARD_OR_HEARTBEAT.0 }
        } else {
            HostWatch::None
        },
        storage: ParameterStorage {
            save: ParameterStorage::CIA_301.save.filter(|_| has(0x1010, 1)),
            restore: ParameterStorage::CIA_301.restore.filter(|_| has(0x1011, 1)),
            ..ParameterStorage::NONE
        },
        faults: Faults { code: servo::FAULTS.code.filter(|_| has(0x603F, 0)), ..servo::FAULTS },
        nmt: NmtRules::CIA_301,
        lss: eds.device.lss,
        // Files do not say it (CiA 306), and do not deny it either.
        sdo_block_transfer: true,
        pdo: pdo_rules(table.rows()),
        timing: Timing::GUESSED,
        stated_departures: &[],
        variations: if axes.is_empty() { &[] } else { servo::variations::VARIATIONS },
        editions: &[],
    })
}

/// Nothing is kept of rows that make no table.
fn table(rows: Vec<DraftRow>) -> Result<&'static Table, Unkept> {
    let mut facts = vec![RowFacts::NONE; rows.len()];
    let mut places = vec![FREE_PLACES; rows.len()];
    let bare: Vec<Entry> = rows.iter().map(|row| row.entry).collect();
    Table::check(&bare, &mut facts, &mut places).map_err(Unkept::Rows)?;
    let kept: Vec<Entry> = rows.into_iter().map(DraftRow::keep).collect();
    let table = Table::at_run_time(kept.leak(), facts.leak(), places.leak()).map_err(Unkept::Rows)?;
    Ok(Box::leak(Box::new(table)))
}

/// What `[DeviceInfo]` says of the numbers of 1018h, sub-index 1 first.
const fn of_device_info(eds: &Eds) -> [Option<u32>; 3] {
    [eds.device.vendor_number, eds.device.product_number, eds.device.revision_number]
}

/// What 1018h leaves open `[DeviceInfo]` says: the device answers it.
fn say_identity(eds: &Eds, rows: &mut [DraftRow]) {
    for (said, sub_index) in of_device_info(eds).into_iter().zip(1..) {
        let is_open = eds.variable(0x1018, sub_index).is_some_and(|of| of.default.is_none() && of.value.is_none());
        let row = rows.iter_mut().find(|row| row.entry.mux() == Mux::new(0x1018, sub_index));
        if let (true, Some(row), Some(number)) = (is_open, row, said) {
            row.entry.default = DefaultValue::Value(i64::from(number));
        }
    }
}

/// What 1000h and 1018h answer; of the numbers of 1018h that are not there, what `[DeviceInfo]` says.
fn identity(eds: &Eds, table: &'static Table) -> Identity {
    let number = |index, sub_index| {
        let row = table.find(Mux::new(index, sub_index)).ok().map(|slot| table.row(slot))?;
        match row.default {
            DefaultValue::Value(value) => u32::try_from(value).ok(),
            _ => None,
        }
    };
    let [vendor, product, revision] = of_device_info(eds);
    Identity {
        device_type: number(0x1000, 0).unwrap_or(0),
        vendor_id: number(0x1018, 1).or(vendor).unwrap_or(0),
        product_code: number(0x1018, 2).or(product).unwrap_or(0),
        revision_number: number(0x1018, 3).or(revision).unwrap_or(0),
    }
}

/// A name to type: the product's, else the file's.
fn name(eds: &Eds) -> String {
    let of_file = eds.file.file_name.rsplit_once('.').map_or(eds.file.file_name.as_str(), |(stem, _)| stem);
    let names = [names::name(&eds.device.product_name), names::name(of_file)];
    names.into_iter().find(|name| !name.is_empty()).unwrap_or_else(|| "device".to_owned())
}

fn title(eds: &Eds) -> String {
    let (vendor, product) = (eds.device.vendor_name.as_str(), eds.device.product_name.as_str());
    let title = if product.starts_with(vendor) { product.to_owned() } else { format!("{vendor} {product}") };
    if title.trim().is_empty() { "a device without a name".to_owned() } else { title.trim().to_owned() }
}

/// The standard's, as far as the mapping objects do not say less.
fn pdo_rules(rows: &[Entry]) -> PdoRules {
    let of_mappings = || rows.iter().filter(|row| matches!(row.index, 0x1600..=0x17FF | 0x1A00..=0x1BFF));
    let highest = of_mappings().map(|row| row.sub_index).max().unwrap_or(0);
    let can_change = of_mappings().any(|row| row.sub_index == 0 && row.access.is_writable());
    PdoRules { max_objects: highest.min(64), fixed_mapping: highest > 0 && !can_change, ..PdoRules::CIA_301 }
}
