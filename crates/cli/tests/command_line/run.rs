//! `ferrodrive run`: what it prints, what it writes, and how it ends.

use std::path::PathBuf;

use processes::{ferrodrive, scratch};
use serde_json::Value;

fn scenario(name: &str) -> String {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../examples/scenarios").join(name);
    path.to_str().expect("a path").to_owned()
}

#[test]
fn a_scenario_that_passes_ends_with_0_and_one_with_a_false_expectation_with_1_and_what_was_seen() {
    let passed = ferrodrive(&["run", &scenario("brown_out.toml")]);
    assert_eq!(passed.status, Some(0), "{}{}", passed.out, passed.err);
    assert!(passed.out.contains("as expected") && !passed.out.contains("FAILED"), "{}", passed.out);

    let directory = scratch("run-false");
    let file = directory.join("false.toml");
    let text = std::fs::read_to_string(scenario("brown_out.toml")).unwrap();
    std::fs::write(&file, text.replace("that = \"4 fault 0x0002\"", "that = \"4 fault 0x0001\"")).unwrap();
    let path = file.to_str().unwrap();
    let junit = directory.join("result.xml");
    let failed = ferrodrive(&["run", path, "--junit", junit.to_str().unwrap()]);
    assert_eq!(failed.status, Some(1));
    assert!(failed.out.contains("FAILED") && failed.out.contains("the last frames:"), "{}", failed.out);
    assert!(failed.err.contains("4 fault 0x0001: fault 0002h") && failed.err.contains("--seed 1"), "{}", failed.err);
    let xml = std::fs::read_to_string(&junit).unwrap();
    assert!(xml.contains("failures=\"1\"") && xml.contains("message=\"fault 0002h\""), "{xml}");

    let json = ferrodrive(&["run", path, "--json"]);
    assert_eq!((json.status, json.out.lines().count(), json.err.as_str()), (Some(1), 1, ""));
    let said: serde_json::Value = serde_json::from_str(&json.out).unwrap();
    assert_eq!(said["ok"], false);
    let rows = said["rows"].as_array().unwrap();
    assert!(rows.iter().any(|row| row["verdict"] == "failed" && row["seen"] == "fault 0002h"), "{said}");
}

#[test]
fn a_sweep_reports_how_many_failed_how_figures_are_spread_and_how_to_repeat_a_run() {
    let swept = ferrodrive(&["run", &scenario("step_loss.toml"), "--seeds", "1..2", "--jobs", "2", "--json"]);
    assert_eq!(swept.status, Some(0), "{}{}", swept.out, swept.err);
    let said: serde_json::Value = serde_json::from_str(&swept.out).unwrap();
    assert_eq!((said["runs"].as_u64(), said["passed"].as_u64()), (Some(6), Some(6)));
    let figure = &said["figures"][0];
    assert!(figure["min"].as_f64() < figure["median"].as_f64() && figure["median"].as_f64() < figure["max"].as_f64());
    assert_eq!(figure["lowest"]["values"]["held"], "333ms", "held the longest it loses the most");

    let directory = scratch("run-sweep");
    let file = directory.join("swept.toml");
    let text = std::fs::read_to_string(scenario("step_loss.toml")).unwrap();
    // The longest hold alone loses more than 1000 pulses.
    let text = text.replace("never = \"2 rotor_position = 8000 +- 40\"", "that = \"2 rotor_position > 7000\"");
    std::fs::write(&file, text).unwrap();
    let path = file.to_str().unwrap();
    let junit = directory.join("runs.xml");
    let failed = ferrodrive(&["run", path, "--seeds", "5..5", "--junit", junit.to_str().unwrap()]);
    assert_eq!(failed.status, Some(1), "{}", failed.out);
    // A case for each run, named as it is repeated.
    let xml = std::fs::read_to_string(&junit).unwrap();
    assert!(xml.contains("tests=\"3\" failures=\"1\"") && xml.matches("<testcase ").count() == 3, "{xml}");
    assert!(xml.contains("name=\"--seed 5 --set held=333ms\"") && xml.contains("2 rotor_position &gt; 7000"), "{xml}");
    let again = format!("ferrodrive run {path} --seed 5 --set held=333ms");
    assert!(failed.out.contains(&again) && failed.out.contains("2 of 3 runs passed, 1 failed"), "{}", failed.out);
    let repeated = ferrodrive(&["run", path, "--seed", "5", "--set", "held=333ms"]);
    assert_eq!(repeated.status, Some(1));
}

#[test]
fn a_sweep_reports_what_came_of_each_value_and_a_value_that_is_set_is_not_swept() {
    let directory = scratch("run-values");
    let file = directory.join("values.toml");
    let text = "[parameters]\nvolts = 24\n[sweep]\nvolts = { from = 20, to = 26, step = 2 }\n[machine]\n\
                drive = [{ model = 'zlac8030l', node = 4 }]\n[[step]]\nat = '10ms'\ndo = '4 supply {volts}'\n\
                [[expect]]\nfrom = '1s'\nuntil = '1100ms'\nalways = '4 supply > 23'\n";
    std::fs::write(&file, text).unwrap();
    let path = file.to_str().unwrap();
    let swept = ferrodrive(&["run", path, "--seeds", "1..3", "--json"]);
    let said = swept.json();
    let rows: Vec<_> = said["values"].as_array().expect("a list").iter().collect();
    let counts = rows.iter().map(|row| (row["value"].as_str(), row["passed"].as_u64(), row["failed"].as_u64()));
    let expected = [("20", 0, 3), ("22", 0, 3), ("24", 3, 0), ("26", 3, 0)];
    assert_eq!(
        counts.collect::<Vec<_>>(),
        expected.map(|(value, passed, failed)| (Some(value), Some(passed), Some(failed)))
    );
    let text = ferrodrive(&["run", path, "--seeds", "1..3"]).out;
    let row = text.lines().find(|line| line.starts_with("volts") && line.contains("22")).expect("a row of 22");
    assert_eq!(row.split_whitespace().collect::<Vec<_>>(), ["volts", "22", "3", "0", "3"], "{text}");

    let set = ferrodrive(&["run", path, "--seeds", "1..3", "--set", "volts=26", "--json"]);
    let said = set.json();
    assert_eq!(
        (&said["runs"], &said["passed"], &said["values"]),
        (&3.into(), &3.into(), &Value::Array(Vec::new())),
        "{said}"
    );
}

#[test]
fn of_several_scenarios_each_is_a_row_and_a_suite_and_one_that_fails_is_enough() {
    let directory = scratch("run-several");
    let path = |name: &str| directory.join(name).to_str().expect("UTF-8").to_owned();
    let (fine, junit) = (path("fine.toml"), path("all.xml"));
    let (wrong, broken) = (path("wrong.toml"), path("broken.toml"));
    let machine =
        "machine = { drive = [{ model = 'zlac8030l', node = 4 }] }\nlimit = '500ms'\n[parameters]\nlevel = 20\n";
    std::fs::write(&fine, format!("title = 'Fine'\n{machine}[[expect]]\nthat = '4 supply > {{level}}'\n")).unwrap();
    std::fs::write(&wrong, format!("title = 'Wrong'\n{machine}[[expect]]\nthat = '4 fault'\n")).unwrap();
    std::fs::write(&broken, "title = 'Broken'\n").unwrap();

    let passed = ferrodrive(&["run", &fine, &scenario("brown_out.toml"), "--jobs", "2", "--set", "level=21"]);
    assert_eq!(passed.status, Some(0), "{}{}", passed.out, passed.err);
    assert!(passed.out.contains("2 of 2 scenarios passed"), "{}", passed.out);

    let failed = ferrodrive(&["run", &fine, &wrong, "--junit", &junit]);
    assert_eq!(failed.status, Some(1), "{}{}", failed.out, failed.err);
    let rows: Vec<&str> = failed.out.lines().collect();
    assert!(rows[1].starts_with("ok ") && rows[1].contains("1 of 1"), "{}", failed.out);
    assert!(
        rows[2].starts_with("FAILED ") && rows[2].contains("line 7: 4 fault: not by the end of the run"),
        "{}",
        failed.out
    );
    assert!(failed.err.contains(&format!("ferrodrive run {wrong} --seed 1")), "{}", failed.err);
    let xml = std::fs::read_to_string(&junit).unwrap();
    assert_eq!((xml.matches("<testsuite ").count(), xml.matches("<failure ").count()), (2, 1), "{xml}");

    let broken_too = ferrodrive(&["run", &broken, &fine, &wrong, "--json", "--junit", &junit]);
    assert_eq!(broken_too.status, Some(1), "{}", broken_too.out);
    let said = broken_too.json();
    let counts = [&said["passed"], &said["failed"], &said["unusable"], &said["complete"]];
    assert_eq!(counts, [&Value::from(1), &1.into(), &1.into(), &true.into()], "{said:#}");
    assert!(
        said["scenarios"][0]["error"]["message"].as_str().unwrap().contains("a scenario needs 'machine'"),
        "{said:#}"
    );
    assert_eq!(std::fs::read_to_string(&junit).unwrap().matches("<error ").count(), 1);

    let nobodys = ferrodrive(&["run", &fine, &wrong, "--set", "levle=1"]);
    assert_eq!(nobodys.status, Some(2));
    assert!(nobodys.err.contains("none of the 2 scenarios has a parameter 'levle'"), "{}", nobodys.err);
}

#[test]
fn a_sweep_says_when_the_seed_makes_no_difference_and_what_would() {
    let directory = scratch("run-random");
    let alike = directory.join("alike.toml");
    let text = std::fs::read_to_string(scenario("brown_out.toml")).unwrap();
    std::fs::write(&alike, text.replacen("[machine]", "[machine]\ntiming = 'ideal'", 1)).unwrap();
    let swept = ferrodrive(&["run", alike.to_str().unwrap(), "--seeds", "1..2"]);
    assert_eq!(swept.status, Some(0), "{}{}", swept.out, swept.err);
    assert!(
        swept.out.contains("note: all seeds give the same run") && swept.out.contains("realism = \"full\""),
        "{}",
        swept.out
    );
    let file = directory.join("random.toml");
    let random = "machine = { realism = 'full', drive = [{ model = 'zlac8030l', node = 4 }] }\nend = '1500ms'\n\
                  [[host]]\ndo = ['4 velocity 60rpm no-wait']\n";
    std::fs::write(&file, random).unwrap();
    let swept = ferrodrive(&["run", file.to_str().unwrap(), "--seeds", "1..2", "--json"]);
    assert_eq!(swept.json()["seeds_differ"], true, "{}", swept.out);
}

#[test]
fn what_cannot_be_run_is_refused_with_its_place() {
    let directory = scratch("run-refused");
    let file = directory.join("bad.toml");
    std::fs::write(
        &file,
        "machine = { drive = [{ model = 'zlac8030l', node = 4 }] }\n[[expect]]\nthat = '5 powered'\n",
    )
    .unwrap();
    let path = file.to_str().unwrap();
    let ended_with = |status: i32, arguments: &[&str], said: &str| {
        let ended = ferrodrive(arguments);
        assert_eq!(ended.status, Some(status), "{arguments:?}: {}", ended.err);
        assert!(ended.err.contains(said), "{arguments:?}: {}", ended.err);
    };
    let refused = |arguments: &[&str], said: &str| ended_with(2, arguments, said);
    ended_with(1, &["run", path], "bad.toml:3:8: the machine has no node 5; it has: 4");
    ended_with(
        1,
        &["run", &scenario("step_loss.toml"), "--set", "hold=1s"],
        "it has no parameter 'hold'; it has: held",
    );
    ended_with(1, &["run", &scenario("step_loss.toml"), "--set", "held=long"], "does not begin with a number");
    ended_with(1, &["run", "/nowhere.toml"], "cannot use the scenario /nowhere.toml");
    refused(&["run", path, "--seeds", "9..1"], "FIRST..LAST");
    refused(&["--timeout", "1s", "run", path], "--timeout has no effect on run");
}
