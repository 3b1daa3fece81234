//! The pages about machine files and scenarios name every key and every form, and what they show as an example is taken.

use std::path::{Path, PathBuf};

use host::control::ERROR_KINDS;
use machine::file::{BUS_KEYS, DRIVE_KEYS, Machine};
use scenario::entries::{EXPECT_KEYS, HOST_KEYS, LINE_KEYS, STEP_KEYS};
use scenario::{Runner, Scenario, command, condition, file};

fn folder(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..").join(name)
}

fn page(name: &str) -> String {
    std::fs::read_to_string(folder("docs").join(name)).expect("the page")
}

/// The blocks of TOML of a page.
fn blocks(page: &str) -> impl Iterator<Item = &str> {
    page.split("```toml\n").skip(1).filter_map(|rest| rest.split("```").next())
}

/// The rows of the table below this heading have these keys in their first column, and no others.
#[track_caller]
fn table_has(page: &str, heading: &str, keys: &[&str]) {
    let rest = page.split(&format!("## {heading}\n")).nth(1).unwrap_or_else(|| panic!("no heading {heading}"));
    rows_are(rest.split("\n## ").next().unwrap_or_default(), heading, keys);
}

/// The rows of the table with this head have these keys in their first column, and no others.
#[track_caller]
fn table_follows(page: &str, head: &str, keys: &[&str]) {
    let rest = page.split(head).nth(1).unwrap_or_else(|| panic!("no table {head}"));
    rows_are(rest.split("\n\n").next().unwrap_or_default(), head, keys);
}

#[track_caller]
fn rows_are(section: &str, place: &str, keys: &[&str]) {
    let rows = section.lines().filter_map(|line| line.strip_prefix("| `")?.split('`').next());
    let mut found: Vec<_> = rows.collect();
    let mut keys = keys.to_vec();
    found.sort_unstable();
    keys.sort_unstable();
    assert_eq!(found, keys, "below {place}");
}

#[test]
fn the_page_of_machine_files_has_every_key_and_its_examples_are_machines() {
    let page = page("machine-file.md");
    table_has(&page, "The bus", BUS_KEYS);
    table_has(&page, "A drive", DRIVE_KEYS);
    let mut machines = 0;
    // A maker's sheet that a reader has; the standard's servo has objects of those types elsewhere.
    let there =
        [("servo.eds", "cia402"), ("2100:01", "60C5"), ("2100:02", "60C6"), ("2100:03", "6087"), ("2100:04", "60C6")];
    for block in blocks(&page) {
        let block = there.iter().fold(block.to_owned(), |block, (named, there)| block.replace(named, there));
        let machine = Machine::parse(&block).unwrap_or_else(|bad| panic!("{bad}"));
        machine.build().unwrap_or_else(|bad| panic!("{bad}"));
        machines += 1;
    }
    assert!(machines >= 1);
}

#[test]
fn the_page_of_scenarios_has_every_key_and_form_and_its_examples_are_scenarios() {
    let page = page("scenarios.md");
    table_has(&page, "The file", file::KEYS);
    table_has(&page, "Steps", STEP_KEYS);
    table_has(&page, "Hosts", HOST_KEYS);
    table_has(&page, "Lines of a host", LINE_KEYS);
    table_has(&page, "Expectations", EXPECT_KEYS);
    for form in condition::FORMS.iter().map(|form| (*form).to_owned()).chain(command::forms()) {
        assert!(page.contains(&form), "{form} is not on the page");
    }
    for (kind, _) in host::events::KINDS {
        assert!(page.contains(&format!("`{kind}`")), "the event {kind} is not on the page");
    }
    let mut scenarios = 0;
    for block in blocks(&page) {
        Scenario::parse(block, Path::new("")).unwrap_or_else(|bad| panic!("{bad}"));
        scenarios += 1;
    }
    assert!(scenarios >= 1);
}

#[test]
fn the_page_of_control_and_its_schema_have_every_kind_of_error() {
    table_follows(&page("control.md"), "| `kind` of an error | means |\n", &ERROR_KINDS);
    let schema: serde_json::Value = serde_json::from_str(&page("control.schema.json")).expect("JSON");
    let mut kinds = Vec::new();
    enums_with("syntax", &schema, &mut kinds);
    assert_eq!(kinds, [ERROR_KINDS.to_vec()]);
}

/// The lists of `enum` that have this value.
fn enums_with<'a>(value: &str, schema: &'a serde_json::Value, found: &mut Vec<Vec<&'a str>>) {
    if let Some(list) = schema["enum"].as_array() {
        let words: Vec<&str> = list.iter().filter_map(|word| word.as_str()).collect();
        found.extend(words.contains(&value).then_some(words));
    }
    let inner: Vec<&serde_json::Value> = match schema {
        serde_json::Value::Object(fields) => fields.values().collect(),
        serde_json::Value::Array(items) => items.iter().collect(),
        _ => Vec::new(),
    };
    inner.into_iter().for_each(|part| enums_with(value, part, found));
}

#[test]
fn the_scenarios_of_the_handbook_pass_as_it_says_they_do() {
    let page = page("handbook/write-a-scenario.md");
    let mut outcomes = blocks(&page).map(|block| {
        let scenario = Scenario::parse(block, Path::new("")).unwrap_or_else(|bad| panic!("{bad}"));
        Runner::new(&scenario, None).unwrap_or_else(|bad| panic!("{bad}")).run()
    });
    let (first, second) = (outcomes.next().expect("the first version"), outcomes.next().expect("the second one"));
    assert!(first.passed() && second.passed() && outcomes.next().is_none());
    // What it prints has a row for each thing that was asked.
    first.rows.iter().for_each(|row| assert!(page.contains(&format!("{}  ", row.asked)), "{row:?}"));
    // Of the second: 2000h after the last frame the drive begins to stop, half a second later it stands.
    let cut = second.rows.iter().find(|row| row.asked == "4 cable cut").and_then(|row| row.at).expect("it was cut");
    let stood_s = second.figures[0].1 - (cut - can::Instant::ZERO).as_secs_f64();
    assert!((1.3..1.7).contains(&stood_s), "{stood_s}");
}

#[test]
fn without_the_cable_the_first_version_of_the_handbook_stops_as_well() {
    let page = page("handbook/write-a-scenario.md");
    let block = blocks(&page).next().expect("the first version");
    let (before, step) = block.split_once("[[step]]").expect("a step");
    let expect =
        step.split_once("[[expect]]").expect("an expectation").1.replace("after = \"cable\"", "after = \"host\"");
    let text = format!("{before}[[expect]]{expect}");
    let scenario = Scenario::parse(&text, Path::new("")).unwrap_or_else(|bad| panic!("{bad}"));
    assert!(Runner::new(&scenario, None).unwrap_or_else(|bad| panic!("{bad}")).run().passed());
}

#[test]
fn the_machine_of_the_examples_can_be_built() {
    let machine = machine::file::read(&folder("examples/machine.toml")).unwrap_or_else(|reason| panic!("{reason}"));
    let mut world = machine.build().unwrap_or_else(|bad| panic!("{bad}"));
    world.run_for(std::time::Duration::from_secs(1));
    for number in [4, 1, 2] {
        assert!(world.report(number).is_ok_and(|report| report.powered && report.error_code == 0), "node {number}");
    }
}
