//! The worked scenarios of `examples/scenarios` run as they say, whatever the seed; and a false expectation is found out.

use std::path::PathBuf;

use scenario::{Outcome, Runner, Scenario, Verdict};

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../examples/scenarios")
}

fn read(name: &str) -> Scenario {
    Scenario::read(&folder().join(name)).unwrap_or_else(|reason| panic!("{reason}"))
}

fn run(scenario: &Scenario, seed: u64) -> Outcome {
    Runner::new(scenario, Some(seed)).unwrap_or_else(|bad| panic!("{bad}")).run()
}

fn failures(outcome: &Outcome) -> String {
    let row = |row: &scenario::Row| {
        let at = row.at.map_or("never".into(), |at| at.to_string());
        format!("{:?} line {} {} [{}]: {}: {}", row.verdict, row.place, row.kind.word(), at, row.asked, row.seen)
    };
    let rows: Vec<_> = outcome.rows.iter().map(row).collect();
    format!("{}\n{}\n{:?}\n{}", outcome.title, rows.join("\n"), outcome.figures, outcome.last_frames.join("\n"))
}

#[track_caller]
fn passes(name: &str) {
    let scenario = read(name);
    for seed in 1..=5 {
        let outcome = run(&scenario, seed);
        assert!(outcome.passed(), "seed {seed}: {}", failures(&outcome));
        assert!(outcome.end < scenario_limit(), "it ran into its limit: {}", failures(&outcome));
    }
}

/// Virtual time that none of them needs.
fn scenario_limit() -> can::Instant {
    can::Instant::from_secs(30)
}

macro_rules! worked {
    ($($name:ident)*) => {
        $(
            #[test]
            fn $name() {
                passes(concat!(stringify!($name), ".toml"));
            }
        )*

        const NAMES: &[&str] = &[$(stringify!($name)),*];
    };
}

worked! {
    brown_out host_dies encoder_breaks one_node_id_twice bus_off battery_lost step_loss emergency_stop homing_stuck_switch
    wrong_wheel machine_with_io arm_loses_a_joint
}

#[test]
fn each_file_of_the_folder_is_run_here() {
    for entry in std::fs::read_dir(folder()).expect("the folder") {
        let name = entry.expect("an entry").file_name().into_string().expect("a name");
        let known = name.strip_suffix(".toml").is_none_or(|name| NAMES.contains(&name));
        assert!(known, "{name} is run by no test");
    }
}

#[test]
fn the_same_seed_gives_the_same_run_and_a_sweep_goes_through_the_parameter() {
    let scenario = read("step_loss.toml");
    assert_eq!(run(&scenario, 7), run(&scenario, 7));
    let held = |time: &str| {
        let other = scenario.with(&[("held".to_owned(), time.to_owned())].into()).expect("a parameter of it");
        let outcome = run(&other, 1);
        assert!(outcome.passed(), "{time}: {}", failures(&outcome));
        8000.0 - outcome.figures[0].1
    };
    // 8 pulses a millisecond, give or take the turns of the field around where the rotor is released.
    let (short, long) = (held("30ms"), held("333ms"));
    assert!((80.0..=560.0).contains(&short) && (2340.0..=2990.0).contains(&long), "{short} and {long} pulses lost");
}

#[test]
fn a_false_expectation_fails_and_says_what_was_seen() {
    let text = std::fs::read_to_string(folder().join("brown_out.toml")).expect("the file");
    let text = text.replace("that = \"4 fault 0x0002\"", "that = \"4 fault 0x0001\"");
    let outcome = run(&Scenario::parse(&text, &folder()).unwrap_or_else(|bad| panic!("{bad}")), 1);
    let failed: Vec<_> = outcome.failures().collect();
    assert_eq!(failed.len(), 1, "{}", failures(&outcome));
    assert_eq!((failed[0].verdict, failed[0].seen.as_str()), (Verdict::Failed, "fault 0002h"));
    assert!(!outcome.last_frames.is_empty());
    assert!(
        outcome.to_junit().contains("failures=\"1\"")
            && outcome.to_junit().contains("<failure message=\"fault 0002h\"")
    );
}
