//! Where a model departs from the standard by its description, asked of the running drive: each departure is there where it is
//! listed, and only there.
//!
//! Those of motion, homing, units and storage have tests of their own beside what they are about.

use canopen::Mux;
use devices::{all, model};
use ferrodrive_tests::bench::{Abort, Bench, BenchSubject, mjoint, zlac8030l, zlim42c};
use ferrodrive_tests::csv::CsvTable;

const NO_SUCH_OBJECT: Abort = 0x0602_0000;

/// The answers of a drive to requests that distinguish departures.
fn asked<S: BenchSubject>(bench: &mut Bench<S>) -> Vec<(&'static str, bool)> {
    let node = bench.node;
    let mut lacks = |index| bench.read(index) == Err(NO_SUCH_OBJECT);
    let mut seen = vec![
        ("no_supported_drive_modes", lacks(0x6502)),
        ("no_store_parameters", lacks(0x1010) && lacks(0x1011)),
        ("no_error_history", lacks(0x1003)),
        ("no_heartbeat_consumer", lacks(0x1016)),
        ("no_mode_display", lacks(0x6061)),
    ];
    let length = |bytes: Result<Vec<u8>, Abort>| bytes.map_or(0, |bytes| bytes.len());
    seen.push(("sub_index_zero", length(bench.read(0x2030)) == 2));
    seen.push(("version_is_number", length(bench.read(0x1009)) == 2));
    // Bit 6, switch on disabled: where a drive that follows CiA 402 begins.
    seen.push(("echoes_controlword", bench.statusword() & 1 << 6 == 0));

    // As it booted: no NMT command was sent.
    let beat = |bench: &mut Bench<S>| {
        bench.heard();
        bench.run_ms(150);
        bench.heard_of(&format!("{:03X}#", 0x700 + u16::from(node))).last().cloned().expect("a heartbeat")
    };
    bench.set(0x1017, 100);
    seen.push(("starts_operational", beat(bench).ends_with("#05")));

    // Operational, nothing mapped or changed by the host: a TPDO can only be an answer.
    bench.send(&format!("000#01{node:02X}")).run_ms(50);
    bench.heard();
    bench.send(&format!("{:03X}#0000000000000000", 0x200 + u16::from(node))).run_ms(20);
    let answered = !bench.heard_of(&format!("{:03X}#", 0x180 + u16::from(node))).is_empty();
    seen.push(("tpdo_answers_rpdo", answered));

    bench.set(0x6040, 0x1F);
    seen.push(("new_set_point_clears_itself", bench.get(0x6040) & 0x10 == 0));

    // Too much for each of them: a fault, or an alarm.
    bench.heard();
    bench.world(&format!("{node} supply 90")).run_ms(500);
    seen.push(("no_emcy", bench.heard_of(&format!("{:03X}#", 0x080 + u16::from(node))).is_empty()));
    seen.push(("heartbeat_tells_alarm", beat(bench).ends_with("#04")));
    seen
}

fn assert_listed(name: &str, seen: Vec<(&'static str, bool)>) {
    let listed: Vec<_> = model(name).expect("a model").departures(all()).map(|departure| departure.key()).collect();
    for (key, seen) in seen {
        assert_eq!(listed.contains(&key), seen, "{name}: {key}");
    }
}

#[test]
fn a_departure_that_can_be_asked_for_is_listed_where_the_running_drive_has_it_and_only_there() {
    assert_listed("zlac8030l", asked(&mut zlac8030l::Bench::new()));
    assert_listed("zlim42c", asked(&mut zlim42c::Bench::new()));
    assert_listed("m4230e17b50", asked(&mut mjoint::Bench::new()));
}

#[test]
fn what_is_reported_of_a_short_rpdo_stands_in_the_profile_that_masters_read() {
    let reported = |name| model(name).and_then(|model| model.pdo.short_rpdo).map(|code| code.0);
    assert_eq!(["zlac8030l", "zlim42c", "m4230e17b50"].map(reported), [Some(0x8210), Some(0x8210), None]);
}

/// Name and object of each departure, sorted.
fn described(name: &str) -> Vec<(String, String)> {
    let departures = model(name).expect("a model").departures(all());
    let object = |mux: Mux| format!("{mux:X}");
    let mut found: Vec<_> = departures
        .map(|departure| (departure.key().to_owned(), departure.object().map(object).unwrap_or_default()))
        .collect();
    found.sort();
    found
}

/// The same as the manual has it.
fn printed(file: &str) -> Vec<(String, String)> {
    let table = CsvTable::parse(file).expect("a table");
    let mut rows: Vec<_> =
        table.rows().map(|row| (row.get("departure").to_owned(), row.get("object").to_owned())).collect();
    rows.sort();
    rows
}

#[test]
fn each_drive_departs_from_the_standard_where_its_manual_does_and_nowhere_else() {
    assert_eq!(described("zlac8030l"), printed(include_str!("../../data/zlac8030l/departures.csv")));
    for name in ["zlim42c", "zlim42c-82"] {
        assert_eq!(described(name), printed(include_str!("../../data/zlim42c/departures.csv")), "{name}");
    }
    for name in ferrodrive_tests::mjoint::MODELS {
        assert_eq!(described(name), printed(include_str!("../../data/mjoint/departures.csv")), "{name}");
    }
}

/// The numbers of chapters and sections in words: `5.04, 2614h` has one.
fn numbers(words: &str) -> Vec<Vec<&str>> {
    let is_number = |word: &&str| word.chars().all(|letter| letter.is_ascii_digit() || letter == '.');
    let words = words.split([' ', ',', ';']).filter(|word| !word.is_empty());
    words.filter(is_number).map(|number| number.split('.').collect()).collect()
}

/// What is cited is a section that the manual's row names, or one within it, or around it.
fn assert_cited(name: &str, file: &str) {
    let model = model(name).expect("a model");
    let table = CsvTable::parse(file).expect("a table");
    for departure in model.departures(all()) {
        let object = departure.object().map(|mux| format!("{mux:X}")).unwrap_or_default();
        let rows = table.rows().filter(|row| (row.get("departure"), row.get("object")) == (departure.key(), &*object));
        let sources: Vec<&str> = rows.map(|row| row.get("source")).collect();
        let cited = model.section_of(&departure).unwrap_or_else(|| panic!("{name}: no section: {departure}"));
        let within = |one: &[&str], other: &[&str]| one.starts_with(other) || other.starts_with(one);
        let of_source = |source: &&str| match &numbers(cited)[..] {
            [] => *source == cited,
            cited => cited.iter().any(|one| numbers(source).iter().any(|other| within(one, other))),
        };
        assert!(sources.iter().any(of_source), "{name}: {departure}: cited {cited}, in the manual {sources:?}");
    }
}

#[test]
fn each_departure_is_cited_with_the_section_of_its_manual() {
    assert_cited("zlac8030l", include_str!("../../data/zlac8030l/departures.csv"));
    for name in ["zlim42c", "zlim42c-82"] {
        assert_cited(name, include_str!("../../data/zlim42c/departures.csv"));
    }
    for name in ferrodrive_tests::mjoint::MODELS {
        assert_cited(name, include_str!("../../data/mjoint/departures.csv"));
    }
}

#[test]
fn each_departure_says_what_is_so_and_what_to_do() {
    for departure in all().iter().flat_map(|model| model.departures(all()).collect::<Vec<_>>()) {
        let (what, remedy) = (departure.to_string(), departure.remedy().to_string());
        assert!(what.len() > 15 && !what.ends_with('.'), "{what}");
        assert!(remedy.len() > 15 && !remedy.ends_with('.'), "{what}: {remedy}");
    }
}
