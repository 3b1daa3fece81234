//! OTHER 01 to 10: signatures of store and restore, the date of the configuration, identifiers that nothing may use.

use canopen::od::Entry;
use canopen::{AbortCode, CobId, Mux, NmtCommand};

use crate::bench::{Bench, refused};
use crate::case::{Case, Need, case};
use crate::finding::{Finding, Verdict, fail, not_applicable};

const STORE: Need = Need::Index(0x1010);
const RESTORE: Need = Need::Index(0x1011);

#[rustfmt::skip]
pub(crate) const CASES: &[Case] = &[
    case!("OTHER 01", "Refuse a wrong signature for 1010h:01", "CiA 301, 7.5.2.13", [STORE], [], |bench| wrong_signature(bench, 0x1010, 1, *b"wron")),
    case!("OTHER 02", "Refuse the signature backwards for 1010h:01", "CiA 301, 7.5.2.13", [STORE], [], |bench| wrong_signature(bench, 0x1010, 1, *b"evas")),
    case!("OTHER 03", "Refuse a wrong signature for 1011h:01", "CiA 301, 7.5.2.14", [RESTORE], [], |bench| wrong_signature(bench, 0x1011, 1, *b"wron")),
    case!("OTHER 04", "Refuse the signature backwards for 1011h:01", "CiA 301, 7.5.2.14", [RESTORE], [], |bench| wrong_signature(bench, 0x1011, 1, *b"daol")),
    case!("OTHER 05", "Refuse a wrong signature for 1010h:02", "CiA 301, 7.5.2.13", [Need::Sub(0x1010, 2)], [], |bench| wrong_signature(bench, 0x1010, 2, *b"wron")),
    case!("OTHER 06", "Refuse the signature backwards for 1010h:02", "CiA 301, 7.5.2.13", [Need::Sub(0x1010, 2)], [], |bench| wrong_signature(bench, 0x1010, 2, *b"evas")),
    case!("OTHER 07", "Refuse a wrong signature for 1011h:02", "CiA 301, 7.5.2.14", [Need::Sub(0x1011, 2)], [], |bench| wrong_signature(bench, 0x1011, 2, *b"wron")),
    case!("OTHER 08", "Refuse the signature backwards for 1011h:02", "CiA 301, 7.5.2.14", [Need::Sub(0x1011, 2)], [], |bench| wrong_signature(bench, 0x1011, 2, *b"daol")),
    case!("OTHER 09", "1020h is kept by save, and is 0 once another command changes what is saved", "CiA 301, 7.5.2.23", [Need::Index(0x1020), STORE, Need::Store], [], configuration_date),
    case!("OTHER 10", "Refuse identifiers that nothing may use", "CiA 301, 7.3.5", [], [], restricted),
    case!("OTHER 51", "1010h and 1011h report capabilities in bits 0 and 1 only", "CiA 301, 7.5.2.13", [Need::Sub(0x1010, 1)], [], says_how),
    case!("OTHER 52", "Saved values are there after a reset, and delivered ones after a restore", "CiA 301, 7.5.2.14", [STORE, Need::Writable(0x1017), Need::Store], [], save_and_reset),
];

async fn wrong_signature(bench: &mut Bench, index: u16, sub_index: u8, signature: [u8; 4]) -> Verdict {
    let mux = Mux::new(index, sub_index);
    let codes = [AbortCode::CANNOT_TRANSFER, AbortCode::GENERAL, AbortCode::INVALID_VALUE, AbortCode::LOCAL_CONTROL];
    let answer = bench.download(mux, &signature).await?;
    refused(&format!("\"{}\" for {mux}", String::from_utf8_lossy(&signature)), &answer, &codes)
}

async fn says_how(bench: &mut Bench) -> Verdict {
    let mut seen = Vec::new();
    for (index, meant) in [(0x1010, 0b11), (0x1011, 0b1)] {
        let rows =
            bench.subject.rows().filter(|row| row.index == index && row.sub_index > 0 && row.access.is_readable());
        for mux in rows.map(Entry::mux) {
            let says = bench.number(mux).await?;
            if says & !meant != 0 {
                fail!("{mux} is {says:08X}h: all bits but {meant:b}b are reserved");
            }
            seen.push(format!("{mux} {says:X}h"));
        }
    }
    Ok(seen.join(", "))
}

async fn configuration_date(bench: &mut Bench) -> Verdict {
    let date = Mux::new(0x1020, 1);
    let stored = bench.stored_value(date).await?;
    let kept = changed_date(bench, date).await;
    bench.store_again(date, &stored).await?;
    kept
}

async fn changed_date(bench: &mut Bench, date: Mux) -> Verdict {
    if let Err(code) = bench.download(date, &0x1234_u32.to_le_bytes()).await? {
        fail!("1020h:01 cannot be written: {code}");
    }
    bench.save().await?;
    let after = bench.stored_value(date).await?;
    if after != 0x1234_u32.to_le_bytes() {
        fail!("1020h:01 was saved as 00001234h and is {} after a reset", crate::bench::hex(&after));
    }
    let Some(row) = bench.subject.harmless().next() else { return Ok("1020h is kept".into()) };
    let before = bench.read(row.mux()).await?;
    let mut other = before.clone();
    other[0] ^= 1;
    bench.write(row.mux(), &other).await?;
    // It is about what the device starts with, which a write alone does not change.
    let saved = bench.save().await;
    let says = bench.number(date).await;
    bench.write(row.mux(), &before).await?;
    saved?;
    match says? {
        0 => Ok(format!("1020h is kept by save, and 0 once another {} is saved", row.mux())),
        says => fail!("another {} is saved, and 1020h:01 still is {says:08X}h", row.mux()),
    }
}

/// The identifiers that CiA 301, 7.3.5 reserves, ends included.
const RESTRICTED: [(u32, u32); 6] =
    [(0x000, 0x07F), (0x101, 0x180), (0x581, 0x5FF), (0x601, 0x67F), (0x6E0, 0x6FF), (0x701, 0x7FF)];

async fn restricted(bench: &mut Bench) -> Verdict {
    bench.nmt(NmtCommand::EnterPreOperational).await;
    let subject = bench.subject;
    let pdos = subject.pdos(0x1400).chain(subject.pdos(0x1800)).map(|index| Mux::new(index, 1));
    let objects = [Mux::new(0x1005, 0), Mux::new(0x1014, 0)].into_iter().chain(pdos);
    let writable = |mux: &Mux| subject.description.row(*mux).is_some_and(|row| row.access.is_writable());
    let codes = [AbortCode::INVALID_VALUE, AbortCode::VALUE_TOO_HIGH, AbortCode::VALUE_TOO_LOW, AbortCode::GENERAL];
    let mut checked = 0;
    for mux in objects.filter(writable) {
        switch_off(bench, mux).await?;
        bench.touch(mux).await?;
        for id in RESTRICTED.into_iter().flat_map(|(first, last)| first..=last) {
            let answer = bench.download(mux, &id.to_le_bytes()).await?;
            refused(&format!("{id:03X}h for {mux}"), &answer, &codes)?;
            checked += 1;
        }
        bench.put_back().await?;
    }
    if checked == 0 {
        not_applicable!("no COB-ID can be written");
    }
    Ok(format!("{checked} writes refused"))
}

/// An identifier moves only while what it identifies is off.
async fn switch_off(bench: &mut Bench, mux: Mux) -> Result<(), Finding> {
    if mux.index != 0x1005 {
        let cob = bench.number(mux).await? as u32 | CobId::INVALID;
        let _ = bench.try_write(mux, &cob.to_le_bytes()).await?;
    }
    Ok(())
}

async fn save_and_reset(bench: &mut Bench) -> Verdict {
    let mux = Mux::new(0x1017, 0);
    let stored = bench.stored_value(mux).await?;
    let kept = saved(bench, mux).await;
    bench.store_again(mux, &stored).await?;
    kept
}

async fn saved(bench: &mut Bench, mux: Mux) -> Verdict {
    if let Err(code) = bench.download(mux, &1234_u16.to_le_bytes()).await? {
        fail!("1017h does not take 1234: {code}");
    }
    bench.save().await?;
    let after = bench.stored_value(mux).await?;
    if after != 1234_u16.to_le_bytes() {
        fail!("1017h was saved as 1234 and is {} after a reset", crate::bench::hex(&after));
    }
    Ok("1017h is 1234 after save and reset".into())
}
