//! Nodes that each have one defect: each fails the case that is meant for it, and no case that it should not.

mod causes;
mod communication;
mod drawn;
mod drive;
mod objects;
mod process_data;
mod servers;
mod station;
mod transfer;

use canopen::CobId;
use conform::{Options, Outcome, Report, Subject, all};
use devices::Description;
use sim::Fidelity;

use crate::bench::{drive_with, node, run, shown};
use crate::complete::{
    complete, extended, producing_sync, with_fixed_mappings, without_consumer, without_remote_frames, without_sync,
};
use causes::Cause;
pub(crate) use station::{Kind, Wrong, answer, reads};
use station::{abort, writes, written};

/// A node that is right but for one thing.
pub(crate) struct Defect {
    /// What is wrong.
    name: &'static str,
    /// The case that is meant for it.
    fails: &'static str,
    /// Why further cases fail, and which: all of them do, and no others.
    also: &'static [Cause],
    kind: Kind,
}

pub(crate) const fn defect(name: &'static str, fails: &'static str, also: &'static [Cause], kind: Kind) -> Defect {
    Defect { name, fails, also, kind }
}

fn all_defects() -> impl Iterator<Item = &'static Defect> {
    let tables = [objects::DEFECTS, transfer::DEFECTS, servers::DEFECTS, process_data::DEFECTS, communication::DEFECTS];
    tables.into_iter().flatten()
}

/// Of a drive the firmware is wrong, not the motor: a mechanical one shows that, and the right one passes at full fidelity too
/// (`models`).
fn report_of(description: &'static Description, kind: Kind, options: Options) -> Report {
    let fidelity = if options.allow_motion { Fidelity::Mechanical } else { Fidelity::Full };
    run(Wrong::new(drive_with(description, fidelity), kind), Subject::of_model(node(), description), options)
}

/// What is not as expected of a defect; none if all is.
fn judged(defect: &Defect, report: &Report) -> Option<String> {
    let failed: Vec<&str> =
        report.cases.iter().filter(|case| case.result == Outcome::Fail).map(|case| case.id).collect();
    let unnoticed = !failed.contains(&defect.fails);
    let listed = || defect.also.iter().flat_map(|cause| cause.cases);
    let allowed = |id: &&&str| **id == defect.fails || listed().any(|case| [**id, "*"].contains(case));
    let further: Vec<_> = failed.iter().filter(|id| !allowed(id)).collect();
    let not_failed = |case: &&&str| ![defect.fails, "*"].contains(case) && !failed.contains(case);
    let missing: Vec<_> = defect
        .also
        .iter()
        .flat_map(|cause| cause.cases.iter().filter(not_failed).map(|case| (*case, cause.why)))
        .collect();
    if !unnoticed && further.is_empty() && missing.is_empty() {
        return None;
    }
    let why = shown(report, |case| further.contains(&&case.id) || case.id == defect.fails);
    Some(format!(
        "{} ({}): {}failed too: {further:?}, passed although listed: {missing:?}\n{}",
        defect.name,
        defect.fails,
        if unnoticed { "UNNOTICED; " } else { "" },
        why
    ))
}

/// The case that asks more than all others together: it writes every restricted identifier to every COB-ID, and looks at nothing
/// but the answers.
const LONGEST: &str = "OTHER 10";

/// Each defect against all cases of the options; against the longest one only if it is to fail.
fn check(defects: &[&Defect], description: &'static Description, options: &Options) {
    let report = |defect: &Defect| {
        let mut options = options.clone();
        let listed = || defect.also.iter().flat_map(|cause| cause.cases);
        if defect.fails != LONGEST && !listed().any(|case| [LONGEST, "*"].contains(case)) {
            options.skip.push(LONGEST.into());
        }
        report_of(description, defect.kind, options)
    };
    let wrong: Vec<String> = defects.iter().filter_map(|defect| judged(defect, &report(defect))).collect();
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), defects.len(), wrong.join("\n"));
}

fn without_drives() -> Options {
    Options { allow_store: true, skip: vec!["402".into()], ..Options::default() }
}

#[test]
fn the_complete_device_passes() {
    let report = report_of(complete(), Kind::Right, without_drives());
    assert!(report.ok, "{:?}\n{}", report.not_restored, shown(&report, crate::bench::failed));
}

#[test]
fn the_extended_device_passes() {
    let report = report_of(extended(), Kind::Right, without_drives());
    assert!(report.ok, "{:?}\n{}", report.not_restored, shown(&report, crate::bench::failed));
}

#[test]
fn a_device_whose_file_has_its_mappings_as_read_only_passes() {
    let description = with_fixed_mappings();
    let station = Wrong::new(drive_with(description, Fidelity::Full), Kind::Right);
    let options = Options { only: vec!["PDO".into()], ..without_drives() };
    let report = run(station, Subject::of_file(node(), description), options);
    assert!(report.ok, "{:?}\n{}", report.not_restored, shown(&report, crate::bench::failed));
    for (id, mapping) in [("PDO 22", "1A00h"), ("PDO 25", "1A00h"), ("PDO 27", "1600h"), ("PDO 60", "1600h")] {
        let case = report.cases.iter().find(|case| case.id == id).unwrap();
        let fixed = format!("the file has {mapping}:00 as read only: its mapping is fixed");
        assert_eq!((case.result, &*case.why), (Outcome::NotApplicable, &*fixed), "{id}");
    }
}

#[test]
fn the_sync_of_a_node_that_produces_it_is_not_taken_for_that_of_a_case() {
    let synchronous = ["PDO 06", "PDO 07", "PDO 12", "PDO 18", "PDO 55", "PDO 56", "PDO 58", "SYNC 03", "SYNC 51"];
    let options = Options { only: synchronous.map(Into::into).to_vec(), ..without_drives() };
    let report = report_of(producing_sync(), Kind::Right, options);
    assert!(report.ok, "{:?}\n{}", report.not_restored, shown(&report, crate::bench::failed));
    let passed: Vec<_> = report.cases.iter().filter(|case| case.result == Outcome::Pass).map(|case| case.id).collect();
    assert_eq!(passed, synchronous);
}

/// By a file without it, of a node that refuses to wait for SYNC, and of one that takes every type and hears none.
#[test]
fn nothing_synchronous_is_asked_of_a_device_without_1005h() {
    let deaf = Kind::Hear(|_, frame| if frame.standard_data_id() == Some(0x80) { vec![] } else { vec![frame] });
    let types = [("PDO 06", 2), ("PDO 07", 0), ("PDO 55", 1), ("PDO 58", 1)];
    for (description, kind) in [(without_sync(), Kind::Right), (complete(), deaf)] {
        let station = Wrong::new(drive_with(description, Fidelity::Full), kind);
        let options = Options { only: types.map(|(id, _)| id.into()).to_vec(), ..without_drives() };
        let report = run(station, Subject::of_model(node(), without_sync()), options);
        for (id, transmission) in types {
            let case = report.cases.iter().find(|case| case.id == id).unwrap();
            let why = match kind {
                Kind::Right => format!(
                    "the device does not take transmission type {transmission}: 0609 0030h (invalid value for parameter)"
                ),
                _ => "the device has no object 1005h, and takes no SYNC".to_owned(),
            };
            assert_eq!((case.result, &*case.why), (Outcome::NotApplicable, &*why), "{id}");
        }
    }
}

/// It refuses COB-IDs without bit 30 (CiA 301, 7.5.2.37).
#[test]
fn a_device_without_remote_frames_passes_and_its_pdo_is_switched_off_by_bit_31_alone() {
    let refuses = Kind::Answer(|_, request| {
        let allows_rtr = writes(&request, 0x1800, 1) && written(&request) & CobId::NO_RTR == 0;
        allows_rtr.then(|| abort(&request, 0x0609_0030))
    });
    let options = Options { only: vec!["PDO".into(), "OTHER 10".into()], ..without_drives() };
    let report = report_of(without_remote_frames(), refuses, options);
    assert!(report.ok, "{:?}\n{}", report.not_restored, shown(&report, crate::bench::failed));
    let result = |id| report.cases.iter().find(|case| case.id == id).map(|case| case.result);
    assert_eq!(["PDO 06", "PDO 56"].map(result), [Some(Outcome::Pass); 2]);
}

/// Cases about objects that the complete device of today does not have.
const EXTENDED: &[&str] = &[
    "OTHER 09", "PDO 08", "PDO 14", "PDO 20", "SDO 61", "SDO 62", "SDO 63", "SDO 64", "SDO 65", "SDO 66", "SDO 67",
    "SDO 68",
];

/// In parts, so that they run side by side.
fn part(number: usize) {
    const PARTS: usize = 4;
    let chosen: Vec<_> =
        all_defects().enumerate().filter(|(place, _)| place % PARTS == number).map(|(_, defect)| defect).collect();
    let (extended_ones, plain): (Vec<_>, Vec<_>) =
        chosen.into_iter().partition(|defect| EXTENDED.contains(&defect.fails));
    check(&plain, complete(), &without_drives());
    check(&extended_ones, extended(), &without_drives());
}

#[test]
fn each_defect_fails_its_case_1() {
    part(0);
}

#[test]
fn each_defect_fails_its_case_2() {
    part(1);
}

#[test]
fn each_defect_fails_its_case_3() {
    part(2);
}

#[test]
fn each_defect_fails_its_case_4() {
    part(3);
}

#[test]
fn an_error_is_forced_by_a_short_pdo_where_there_is_no_1016h() {
    let options = Options { only: vec!["EMCY".into()], ..without_drives() };
    let report = report_of(without_consumer(), Kind::Right, options.clone());
    let of = |id: &str| report.cases.iter().find(|case| case.id == id).map(|case| case.result);
    assert_eq!(["EMCY 04", "EMCY 05", "EMCY 06"].map(of), [Some(Outcome::Pass); 3], "{}", shown(&report, |_| true));
    check(&communication::OF_SHORT_PDOS.iter().collect::<Vec<_>>(), without_consumer(), &options);
}

#[test]
fn each_defect_of_a_drive_fails_its_case() {
    let options = Options { allow_motion: true, only: vec!["402".into()], ..Options::default() };
    let chosen: Vec<_> = drive::DEFECTS.iter().collect();
    check(&chosen, devices::model("cia402").unwrap(), &options);
}

#[test]
fn every_case_has_a_defect_that_fails_it() {
    let meant: Vec<&str> = all_defects().chain(drive::DEFECTS).map(|defect| defect.fails).collect();
    let without: Vec<&str> = all().map(|case| case.id).filter(|id| !meant.contains(id)).collect();
    assert_eq!(without, [""; 0]);
    let unknown: Vec<&&str> = meant.iter().filter(|id| !all().any(|case| case.id == **id)).collect();
    assert!(unknown.is_empty(), "{unknown:?}");
}
