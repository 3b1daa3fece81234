//! OD 01 to 09: every object as the description has it: access, default, limits.

use canopen::od::{Access, DefaultValue, Entry, Kind};
use canopen::{AbortCode, Mux, NmtCommand};

use super::sdo::limits;
use crate::bench::{Bench, hex, refused};
use crate::case::{Case, case};
use crate::finding::{Finding, Verdict, fail, not_applicable};
use crate::subject::{bytes_of, has_number};

#[rustfmt::skip]
pub(crate) const CASES: &[Case] = &[
    case!("OD 01", "Every object as its access says, in pre-operational", "CiA 301, 7.4.6", [], ["sub_index_count"], access_all),
    case!("OD 02", "Values after a reset of the communication are those as delivered", "CiA 301, 7.4.2", [], [], defaults_of_communication),
    case!("OD 03", "Refuse the write of what can be read only", "CiA 301, 7.2.4.3.17", [], [], write_read_only),
    case!("OD 04", "Refuse the read of what can be written only", "CiA 301, 7.2.4.3.17", [], [], read_write_only),
    case!("OD 05", "Sub-index FFh says the type, where it is there", "CiA 301, 7.4.7", [], [], structure),
    case!("OD 06", "Values at the limits are taken, those beyond refused", "CiA 301, 7.4.6", [], [], all_limits),
    case!("OD 07", "Every object as its access says, in operational", "CiA 301, 7.4.6", [], ["sub_index_count"], access_all_operational),
    case!("OD 08", "Constants are those of the description", "CiA 301, 7.4.2", [], [], constants),
    case!("OD 09", "A value that was read can be written back", "CiA 301, 7.4.6", [], [], write_back),
    case!("OD 51", "Sub-index 00h is the highest sub-index", "CiA 301, 7.4.7", [], ["sub_index_count", "sub_index_zero"], counts),
    case!("OD 52", "1018h has the numbers of the description", "CiA 301, 7.5.2.19", [], [], identity),
    case!("OD 53", "Objects that the description does not have are refused", "CiA 301, 7.2.4.3.17", [], [], absent),
];

/// Single findings that a result lists.
const LISTED: usize = 6;

/// What was found wrong with single objects.
#[derive(Default)]
struct Findings {
    listed: Vec<String>,
    more: usize,
    checked: usize,
}

impl Findings {
    fn add(&mut self, bench: &mut Bench, what: String) {
        if self.listed.len() < LISTED {
            bench.pin();
            self.listed.push(what);
        } else {
            self.more += 1;
        }
    }

    /// A finding of a case of one object.
    fn check(&mut self, bench: &mut Bench, judged: Verdict) -> Result<(), Finding> {
        self.checked += 1;
        match judged {
            Err(Finding::Fail(why)) if why.contains("no answer") => Err(Finding::Fail(why)),
            Err(Finding::Fail(why)) => {
                self.add(bench, why);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn verdict(self, what: &str) -> Verdict {
        if self.listed.is_empty() {
            return Ok(format!("{} {what}", self.checked));
        }
        let more = if self.more > 0 { format!("; and {} more", self.more) } else { String::new() };
        fail!("{}{more}", self.listed.join("; "))
    }
}

async fn access_all(bench: &mut Bench) -> Verdict {
    bench.nmt(NmtCommand::EnterPreOperational).await;
    read_all(bench).await
}

async fn access_all_operational(bench: &mut Bench) -> Verdict {
    bench.nmt(NmtCommand::Start).await;
    read_all(bench).await
}

async fn read_all(bench: &mut Bench) -> Verdict {
    let mut findings = Findings::default();
    let subject = bench.subject;
    for row in subject.rows().filter(|row| row.access.is_readable()) {
        let judged = match bench.upload(row.mux()).await? {
            Ok(data) if fits(row, &data) => Ok(String::new()),
            Ok(data) => Err(Finding::Fail(format!(
                "{} has {} bytes, not those of {}",
                row.mux(),
                data.len(),
                row.data_type.name()
            ))),
            Err(AbortCode::NO_DATA | AbortCode::DEVICE_STATE | AbortCode::LOCAL_CONTROL) => Ok(String::new()),
            // A list that is as long as it is filled (1003h) has no more than it says.
            Err(AbortCode::NO_SUCH_SUB_INDEX) if row.index == 0x1003 => Ok(String::new()),
            Err(code) => Err(Finding::Fail(format!("{} ({}) cannot be read: {code}", row.mux(), row.access.name()))),
        };
        findings.check(bench, judged)?;
    }
    findings.verdict("objects read")
}

fn fits(row: &Entry, data: &[u8]) -> bool {
    row.data_type.kind() == Kind::Bytes || data.len() == row.data_type.size()
}

async fn defaults_of_communication(bench: &mut Bench) -> Verdict {
    let subject = bench.subject;
    let stores = subject.description.storage.save.is_some() || subject.description.has_index(0x1010);
    bench.reset(NmtCommand::ResetCommunication).await?;
    if !stores {
        return as_delivered(bench).await;
    }
    let restore = Mux::new(0x1011, 1);
    if subject.row(0x1011, 1).is_none() || !bench.allow_store {
        not_applicable!("values may have been stored: 1011h restores those as delivered, which needs --allow-store");
    }
    let stored = bench.restorer.stored().await;
    if let Err(code) = bench.download(restore, b"load").await? {
        fail!("{restore} does not take \"load\": {code}");
    }
    bench.reset(NmtCommand::ResetNode).await?;
    let seen = as_delivered(bench).await;
    bench.restorer.store(&stored).await.map_err(Finding::Fail)?;
    bench.save().await?;
    seen
}

async fn as_delivered(bench: &mut Bench) -> Verdict {
    let subject = bench.subject;
    let mut findings = Findings::default();
    for row in subject
        .rows()
        .filter(|row| row.is_communication() && row.access == Access::ReadWrite && subject.is_setting(row))
    {
        let Some(expected) = subject.default_of(row).filter(|_| has_number(row)) else { continue };
        let Ok(has) = bench.upload(row.mux()).await? else { continue };
        findings.checked += 1;
        if has != expected {
            findings.add(bench, format!("{} is {}; as delivered {}", row.mux(), hex(&has), hex(&expected)));
        }
    }
    findings.verdict("values as delivered")
}

async fn constants(bench: &mut Bench) -> Verdict {
    let subject = bench.subject;
    let mut findings = Findings::default();
    for row in subject.rows().filter(|row| is_constant(row)) {
        let Some(expected) = subject.default_of(row) else { continue };
        let judged = match bench.upload(row.mux()).await? {
            Ok(has) if has == expected => Ok(String::new()),
            Ok(has) => {
                Err(Finding::Fail(format!("{} is {}; the description has {}", row.mux(), hex(&has), hex(&expected))))
            }
            Err(code) => Err(Finding::Fail(format!("{} cannot be read: {code}", row.mux()))),
        };
        findings.check(bench, judged)?;
    }
    findings.verdict("constants")
}

/// What never changes: `const`, and counts and identifiers that are read-only.
fn is_constant(row: &Entry) -> bool {
    let read_only = row.access == Access::ReadOnly;
    let counts = row.sub_index == 0
        && matches!(row.index, 0x1010 | 0x1011 | 0x1016 | 0x1018 | 0x1200..=0x15FF | 0x1800..=0x19FF);
    let said = !matches!(row.default, DefaultValue::Text("") | DefaultValue::Bytes([]));
    said && (row.access == Access::Const || read_only && (row.index == 0x1000 || counts))
}

async fn write_read_only(bench: &mut Bench) -> Verdict {
    let codes = [AbortCode::UNSUPPORTED_ACCESS, AbortCode::READ_ONLY, AbortCode::GENERAL];
    let subject = bench.subject;
    let mut findings = Findings::default();
    for row in subject.rows().filter(|row| !row.access.is_writable() && row.data_type.size() > 0) {
        let Ok(data) = bench.upload(row.mux()).await? else { continue };
        let answer = bench.download(row.mux(), &data).await?;
        findings.check(bench, refused(&format!("write of {} ({})", row.mux(), row.access.name()), &answer, &codes))?;
    }
    findings.verdict("writes refused")
}

async fn read_write_only(bench: &mut Bench) -> Verdict {
    let codes = [AbortCode::UNSUPPORTED_ACCESS, AbortCode::WRITE_ONLY, AbortCode::GENERAL];
    let subject = bench.subject;
    let mut findings = Findings::default();
    for row in subject.rows().filter(|row| row.access == Access::WriteOnly) {
        let answer = bench.upload(row.mux()).await?;
        findings.check(bench, refused(&format!("read of {}", row.mux()), &answer, &codes))?;
    }
    if findings.checked == 0 {
        not_applicable!("no object is write-only");
    }
    findings.verdict("reads refused")
}

async fn structure(bench: &mut Bench) -> Verdict {
    let indexes = indexes(bench);
    let mut there = 0;
    for index in indexes {
        let Ok(data) = bench.upload(Mux::new(index, 0xFF)).await? else { continue };
        let [object_type, kind, ..] = data[..] else { continue };
        // Bits 0 to 7: VAR, ARRAY or RECORD; 8 to 15 the type's index.
        if !matches!(object_type, 7..=9) || kind == 0 {
            fail!("{index:04X}h:FF is {}; expected an object type of 7 to 9 and a data type", hex(&data));
        }
        there += 1;
    }
    if there == 0 {
        not_applicable!("no object has a sub-index FFh");
    }
    Ok(format!("{there} objects say their type"))
}

fn indexes(bench: &Bench) -> Vec<u16> {
    let mut indexes: Vec<u16> = bench.subject.rows().map(|row| row.index).collect();
    indexes.dedup();
    indexes
}

async fn all_limits(bench: &mut Bench) -> Verdict {
    let too_high = [AbortCode::INVALID_VALUE, AbortCode::VALUE_TOO_HIGH, AbortCode::GENERAL];
    let too_low = [AbortCode::INVALID_VALUE, AbortCode::VALUE_TOO_LOW, AbortCode::GENERAL];
    let subject = bench.subject;
    let mut findings = Findings::default();
    for row in subject.rows().filter(|row| subject.is_setting(row) && !row.is_communication()) {
        let (Some((low, high)), (lowest, highest)) = (limits(row), row.data_type.range()) else { continue };
        let beyond = [(high < highest).then(|| (high + 1, &too_high)), (low > lowest).then(|| (low - 1, &too_low))];
        for (value, codes) in beyond.into_iter().flatten() {
            let answer = bench.try_write(row.mux(), &bytes_of(row.data_type, value)).await?;
            findings.check(bench, refused(&format!("{value} for {} ({low} to {high})", row.mux()), &answer, codes))?;
        }
        for value in [low, high].into_iter().filter(|_| row.values.is_empty()) {
            let judged = match bench.try_write(row.mux(), &bytes_of(row.data_type, value)).await? {
                Ok(()) | Err(AbortCode::DEVICE_STATE | AbortCode::PARAMETER_INCOMPATIBLE) => Ok(String::new()),
                Err(AbortCode::INVALID_VALUE) if is_code(row) => Ok(String::new()),
                Err(code) => {
                    Err(Finding::Fail(format!("{} does not take {value} ({low} to {high}): {code}", row.mux())))
                }
            };
            findings.check(bench, judged)?;
        }
        bench.put_back().await?;
    }
    if findings.checked == 0 {
        not_applicable!("no object has limits narrower than its type");
    }
    findings.verdict("values at the limits and beyond")
}

/// A drive's choice among codes of which some are reserved or the maker's (CiA 402-2): limits are about numbers.
fn is_code(row: &Entry) -> bool {
    let of_first_axis = 0x6000 | row.index & 0x7FF;
    row.index >= 0x6000 && matches!(of_first_axis, 0x6007 | 0x605A..=0x605E | 0x6060 | 0x6086 | 0x6098)
}

async fn write_back(bench: &mut Bench) -> Verdict {
    bench.nmt(NmtCommand::EnterPreOperational).await;
    let subject = bench.subject;
    let mut findings = Findings::default();
    // A mapping is written by its procedure only, an inhibit time and a SYNC start value while the PDO is off (CiA 301, 7.5.2.37).
    let is_bound = |row: &Entry| matches!((row.index, row.sub_index), (0x1600..=0x17FF | 0x1A00..=0x1BFF, _) | (0x1400..=0x19FF, 3 | 6));
    for row in subject.rows().filter(|row| subject.is_setting(row) && !is_bound(row)) {
        let Ok(data) = bench.upload(row.mux()).await? else { continue };
        if data.is_empty() {
            continue;
        }
        let judged = match bench.try_write(row.mux(), &data).await? {
            Ok(()) => {
                let after = bench.read(row.mux()).await?;
                if after == data {
                    Ok(String::new())
                } else {
                    Err(Finding::Fail(format!("{} took {} and reads as {}", row.mux(), hex(&data), hex(&after))))
                }
            }
            Err(AbortCode::DEVICE_STATE | AbortCode::LOCAL_CONTROL) => Ok(String::new()),
            Err(code) => {
                Err(Finding::Fail(format!("{} does not take its own value {}: {code}", row.mux(), hex(&data))))
            }
        };
        findings.check(bench, judged)?;
    }
    findings.verdict("values taken back")
}

async fn counts(bench: &mut Bench) -> Verdict {
    let subject = bench.subject;
    let mut findings = Findings::default();
    for index in indexes(bench) {
        let highest =
            subject.rows().filter(|row| row.index == index && row.sub_index < 0xFF).map(|row| row.sub_index).max();
        // What counts is in use (CiA 301, 7.5.2.4, 7.5.2.36 and 7.5.2.38) says less.
        let counts_used = matches!(index, 0x1003 | 0x1600..=0x17FF | 0x1A00..=0x1BFF);
        let Some(highest) = highest.filter(|highest| *highest > 0 && !counts_used) else { continue };
        let says = bench.read(Mux::new(index, 0)).await?;
        let judged = match says[..] {
            [says] if says == highest => Ok(String::new()),
            [says] => Err(Finding::Fail(format!("{index:04X}h:00 says {says}; the highest sub-index is {highest}"))),
            _ => Err(Finding::Fail(format!("{index:04X}h:00 has {} bytes, not one", says.len()))),
        };
        findings.check(bench, judged)?;
    }
    findings.verdict("records and arrays")
}

async fn identity(bench: &mut Bench) -> Verdict {
    let identity = bench.subject.description.identity;
    let mut seen = Vec::new();
    for (sub_index, expected) in [(1, identity.vendor_id), (2, identity.product_code), (3, identity.revision_number)] {
        if bench.subject.row(0x1018, sub_index).is_none() {
            continue;
        }
        let says = bench.number(Mux::new(0x1018, sub_index)).await? as u32;
        if says != expected {
            fail!("1018h:{sub_index:02X} is {says:08X}h; the description has {expected:08X}h");
        }
        seen.push(format!("{says:08X}h"));
    }
    match seen.is_empty() {
        true => fail!("1018h:01 is mandatory and is not there"),
        false => Ok(seen.join(", ")),
    }
}

async fn absent(bench: &mut Bench) -> Verdict {
    let codes = [AbortCode::NO_SUCH_OBJECT, AbortCode::GENERAL];
    let all = [0x0020, 0x1002, 0x1004, 0x1012, 0x1028, 0x13FF, 0x1FFF, 0x2FFF, 0x5FFE, 0x9FFF, 0xFFFE];
    let mut findings = Findings::default();
    for index in all.into_iter().filter(|index| !bench.subject.description.has_index(*index)) {
        let answer = bench.upload(Mux::new(index, 0)).await?;
        let answer = answer.map(|_| ());
        findings.check(bench, refused(&format!("read of {index:04X}h"), &answer, &codes))?;
        let answer = bench.download(Mux::new(index, 0), &[0]).await?;
        findings.check(bench, refused(&format!("write of {index:04X}h"), &answer, &codes))?;
    }
    findings.verdict("requests refused")
}
