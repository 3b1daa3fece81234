//! Hostile files: each is refused with a place, in good time and without much memory, or is bounded.

use std::path::Path;
use std::time::Duration;

use machine::file::Machine;
use scenario::{Runner, Scenario};
use words::document::BadFile;

const MACHINE: &str = "machine = { drive = [{ model = 'zlac8030l', node = 4 }] }\n";

fn parse(text: &str) -> Result<Scenario, BadFile> {
    Scenario::parse(text, Path::new(""))
}

fn refusal(rest: &str) -> String {
    parse(&format!("{MACHINE}{rest}")).err().map(|bad| bad.to_string()).unwrap_or_default()
}

#[test]
fn times_that_make_no_sense_are_refused_with_their_place() {
    for (time, said) in [
        ("nan", "'at' is nan; expected a time as text"),
        ("1.5", "'at' is 1.5; expected a time as text"),
        ("'nan s'", "does not begin with a number"),
        ("'-1s'", "a time is between 0 and a year"),
        ("'inf s'", "does not begin with a number"),
        ("'1e999s'", "a time is between 0 and a year"),
        ("'2 days'", "days"),
        ("'100000s'", "between 0 s and 24 h"),
        ("'5'", "has no unit"),
    ] {
        let refused = refusal(&format!("[[step]]\nat = {time}\ndo = '4 rotor lock'\n"));
        assert!(refused.starts_with("line 3, column 6: ") && refused.contains(said), "{time}: {refused}");
    }
    assert!(refusal("limit = '1000h'").contains("limit") && refusal("sample = '1us'").contains("24 h"));
}

#[test]
fn what_does_not_fit_together_is_refused() {
    for (rest, said) in [
        ("[[step]]\nafter = 'missing'\ndo = '4 rotor lock'", "there is no step or host 'missing'"),
        ("[[step]]\nafter = 'x'\nat = '1s'\ndo = '4 rotor lock'", "it has 'at' already"),
        ("[[step]]\ndo = '5 rotor lock'", "the machine has no node 5; it has: 4"),
        ("[[step]]\ndo = '4 get'", "changes nothing; use [[expect]]"),
        ("[[step]]\ndo = '4 dance'", "unknown command"),
        ("[[step]]\nwithin = '1s'\ndo = '4 rotor lock'", "'within' needs 'when'"),
        ("[[expect]]\nwhy = 'x'", "needs 'that', 'always' or 'never'"),
        ("[[expect]]\nthat = '4 powered'\nnever = '4 fault'", "make another expectation of this"),
        ("[[expect]]\nalways = '4 boots'", "an event holds at an instant only"),
        ("[[expect]]\nthat = '4 powered'\nat = '1s'\nuntil = '2s'", "'at' is an instant"),
        ("[[expect]]\nthat = '4 powered'\nfrom = '3s'\nuntil = '2s'", "it ends before it begins"),
        ("[[host]]\ndo = [{ do = '4 enable', is = 5 }]", "'is' needs something that is read"),
        ("[[host]]\ndo = 5", "expected what the host does as text"),
        ("[sweep]\ntorque = [1]", "there is no parameter 'torque'"),
        ("[parameters]\na = 1\n[sweep]\na = { from = 0, to = 1, step = 0 }", "does not give 1 to"),
        ("[parameters]\na = 1\n[sweep]\na = { from = 0, to = 1e12, step = 1 }", "does not give 1 to"),
        ("[[step]]\ndo = '4 supply {volts}'", "there is no parameter 'volts'"),
        ("[figures]\na = 'most 4 current'", "min, max, mean, peak or last"),
        ("[stpe]\n", "did you mean step?"),
        ("machine = 'twice.toml'", "duplicate key"),
    ] {
        let refused = refusal(rest);
        assert!(refused.starts_with("line ") && refused.contains(said), "{rest}: {refused}");
    }
}

#[test]
fn a_scenario_that_names_itself_as_its_machine_is_none() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("cycle.toml");
    std::fs::write(&path, format!("machine = '{}'\n", path.display())).expect("a file");
    let refused = Scenario::read(&path).err().unwrap_or_default();
    assert!(refused.contains("a machine file has no 'machine'"), "{refused}");
    let nowhere = parse("machine = '/dev/zero'").err().map(|bad| bad.to_string()).unwrap_or_default();
    assert!(nowhere.contains("not a regular file") || cfg!(not(unix)), "{nowhere}");
}

#[test]
fn a_million_of_anything_is_refused_or_taken_in_good_time() {
    let steps = "[[step]]\ndo='4 rotor lock'\n".repeat(40_000);
    assert!(refusal(&steps).contains("'step' has more than 1000 entries"));
    let wrong = "[[x]]\n".repeat(150_000);
    let refused = refusal(&wrong);
    assert!(refused.contains("a scenario has no 'x'") && refused.len() < 10_000, "{}", refused.len());
    let drives = "[[drive]]\nmodel='zlac8030l'\nnode=4\n".repeat(20_000);
    let refused = Machine::parse(&drives).err().map(|bad| bad.to_string()).unwrap_or_default();
    assert!(refused.contains("a bus has at most 127 nodes"), "{refused}");
    for deep in ["[".repeat(500_000), format!("a = {}", "[".repeat(500_000)), format!("a = {}", "{a=".repeat(200_000))]
    {
        assert!(refusal(&deep).starts_with("line "));
    }
    let keys = (0..50_000).map(|n| format!("k{n} = 1\n")).collect::<String>();
    assert!(refusal(&keys).contains("and 49980 more like these"));
}

/// The line of `when` or `after`, and not that of what the step does.
#[test]
fn what_a_step_waits_for_is_marked_where_it_stands() {
    let lines = MACHINE.lines().count();
    for (waits, said) in [
        ("when = '7 velocity > 5'", "the machine has no node 7"),
        ("when = 'done missing'", "there is no step or host 'missing'"),
        ("after = 'missing'", "there is no step or host 'missing'"),
    ] {
        let refused = parse(&format!("{MACHINE}[[step]]\ndo = '4 rotor lock'\n{waits}\n")).err().unwrap().to_string();
        let at = format!("line {}, column", lines + 3);
        assert!(refused.contains(&at) && refused.contains(said), "{refused}");
    }
    let text = format!("{MACHINE}[[step]]\ndo = '4 rotor lock'\nwithin = '200ms'\nwhen = '4 velocity > 5'\n");
    let scenario = parse(&text).unwrap_or_else(|bad| panic!("{bad}"));
    let outcome = Runner::new(&scenario, None).unwrap_or_else(|bad| panic!("{bad}")).run();
    let rows: Vec<_> = outcome.failures().map(|row| (row.place, row.seen.as_str())).collect();
    assert_eq!(rows, [(lines + 4, "'4 velocity > 5' did not hold within 0.2 s: 0 r/min")]);
}

#[test]
fn what_would_never_end_ends_at_the_limit_and_says_what_it_waited_for() {
    let text = format!(
        "{MACHINE}limit = '500ms'\n[[step]]\nwhen = '4 velocity > 5'\ndo = '4 rotor lock'\n\
         [[host]]\nstart = '100ms'\ndo = ['wait 1000s', '4 enable']\n[[expect]]\nthat = '4 fault'\n"
    );
    let scenario = parse(&text).unwrap_or_else(|bad| panic!("{bad}"));
    let outcome = Runner::new(&scenario, None).unwrap_or_else(|bad| panic!("{bad}")).run();
    assert_eq!(Duration::from_nanos(outcome.end.as_nanos()), Duration::from_millis(500));
    let seen: Vec<_> = outcome.failures().map(|row| row.seen.as_str()).collect();
    let expected = [
        "'4 velocity > 5' did not come to hold: 0 r/min",
        "not done by the end of the run",
        "not reached",
        "not by the end of the run: no fault",
    ];
    assert_eq!(seen, expected);
}
