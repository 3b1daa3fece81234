//! `ferrodrive conform`: what it prints and writes, and what it ends with.

#![allow(clippy::print_stderr, reason = "a test that is skipped says why")]

use std::process::{Command, Stdio};

use processes::{done, ferrodrive, page, program, scratch};

#[test]
fn a_model_passes_and_its_departures_are_cited() {
    let report = done(&["conform", "4", "--json"]).json();
    let of = |id: &str| report["cases"].as_array().unwrap().iter().find(|case| case["id"] == id).unwrap().clone();
    assert_eq!((&report["ok"], &report["summary"]["fail"]), (&true.into(), &0.into()));
    let count =
        |result: &str| report["cases"].as_array().unwrap().iter().filter(|case| case["result"] == result).count();
    for result in ["pass", "fail", "expected", "not_applicable", "not_run"] {
        assert_eq!(report["summary"][result], count(result), "{result}");
    }
    // ZLAC8030L quick start guide: no 1010h in the list of chapter 9, times of PDOs in 0.5 ms by the example of 6.1.
    for (id, section, request) in [("OTHER 01", "chapter 9", "604#4010100000000000"), ("PDO 05", "6.1", "000#0104")] {
        let case = of(id);
        assert_eq!(case["result"], "expected", "{case}");
        assert!(case["why"].as_str().unwrap().contains(&format!("V1.00, {section})")), "{case}");
        assert!(case["frames"].as_array().unwrap().contains(&request.into()), "the frames show it: {case}");
    }
    assert_eq!(of("402-32")["result"], "not_run", "no motor is energised without leave");
}

#[test]
fn a_sheet_that_is_not_the_devices_fails_with_status_1_in_every_form() {
    let folder = scratch("conform-wrong");
    let sheet = done(&["eds", "zlac8030l"]).out.replace("DefaultValue=0x40192", "DefaultValue=0x20192");
    let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    std::fs::write(path("wrong.eds"), &sheet).unwrap();
    let (eds, junit, html) = (path("wrong.eds"), path("report.xml"), path("report.html"));
    let arguments = ["conform", "4", "--eds", &eds, "--only", "SDO 01,SDO 05", "--junit", &junit, "--html", &html];
    let ended = ferrodrive(&arguments);
    assert_eq!(ended.status, Some(1), "{}{}", ended.out, ended.err);
    assert!(ended.err.contains("1 of 2 cases failed") && ended.err.contains("SDO 01"), "{}", ended.err);
    assert!(ended.out.contains("584#4300100092010400"), "the frames show it: {}", ended.out);
    assert!(!ended.err.contains("another device"), "its 1018h is that of the file: {}", ended.err);
    let junit = std::fs::read_to_string(junit).unwrap();
    assert!(junit.contains("tests=\"2\" failures=\"1\"") && junit.contains("<failure message=\""), "{junit}");
    let html = std::fs::read_to_string(html).unwrap();
    assert!(html.contains("1 case failed") && html.contains("584#4300100092010400"), "{html}");
    // Under which circumstances: the cases of SDO need no motor.
    let circumstances = "--allow-motion: not given; --allow-store: not given; --only SDO 01,SDO 05";
    assert!(html.contains(circumstances) && html.contains("<dt>Bus</dt><dd>sim</dd>"), "{html}");
    assert!(html.contains(" UTC</dd>"), "{html}");
    assert!(!html.contains("http") && !html.contains("<script"), "the page needs nothing else");
    let json = ferrodrive(&["conform", "4", "--eds", &eds, "--only", "SDO 01", "--json"]).json();
    assert_eq!((&json["ok"], &json["error"]["kind"]), (&false.into(), &"conformance".into()), "{json}");
}

#[test]
fn a_sheet_of_another_device_is_warned_of() {
    let folder = scratch("conform-another");
    let sheet = done(&["eds", "zlac8030l"]).out;
    let (before, after) = sheet.split_once("[1018sub2]").expect("a product code");
    let (row, after) = after.split_once("DefaultValue=").expect("its number");
    let (_, after) = after.split_once('\n').expect("a line");
    let path = folder.join("another.eds");
    std::fs::write(&path, format!("{before}[1018sub2]{row}DefaultValue=0x77\n{after}")).unwrap();
    let ended = ferrodrive(&["conform", "4", "--eds", path.to_str().unwrap(), "--only", "SDO 05"]);
    let said = &ended.err;
    assert!(said.contains("product code") && said.contains("the file is of 00000077h (1018h:02)"), "{said}");
    assert_eq!(said.matches("another device").count(), 1, "one number differs: {said}");
}

#[test]
fn cases_are_chosen_by_number_and_group() {
    let ids = |arguments: &[&str]| {
        let report = done(&[&["conform", "--list", "--json"], arguments].concat()).json();
        let cases = report["cases"].as_array().unwrap().clone();
        cases.iter().map(|case| case["id"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(ids(&["--only", "sdo07,402-01"]), ["SDO 07", "402-01"]);
    assert!(ids(&["--only", "SYNC", "--skip", "SYNC 01"]).iter().all(|id| id.starts_with("SYNC") && id != "SYNC 01"));
    let unknown = ferrodrive(&["conform", "4", "--only", "SDO 99"]);
    assert_eq!(unknown.status, Some(2));
    assert!(unknown.err.contains("got 'SDO 99'"), "{}", unknown.err);
}

/// In a terminal that `script` (util-linux) makes.
#[cfg(unix)]
#[test]
fn a_terminal_shows_how_far_it_is() {
    if Command::new("script").arg("--version").output().is_err() {
        eprintln!("skipped: there is no `script` here, which gives a command a terminal");
        return;
    }
    let line = format!("stty cols 120 rows 24; exec {} conform 4 --only 'SDO 01,SDO 05'", program());
    let mut script = Command::new("script");
    script.args(["-q", "-e", "-c", &line, "/dev/null"]).stdin(Stdio::null());
    script.env("TERM", "xterm").env("NO_COLOR", "1").env_remove("FERRODRIVE_BUS").env_remove("FERRODRIVE_MACHINE");
    let ended = script.output().expect("script runs");
    let shown = String::from_utf8_lossy(&ended.stdout);
    assert!(ended.status.success() && shown.contains("1 of 2: SDO 01 Read 1000h"), "{shown}");
    let cleared = shown.rfind("of 2: SDO 0").zip(shown.find("node 4: "));
    assert!(cleared.is_some_and(|(progress, table)| progress < table), "the table comes after it: {shown}");
}

#[test]
fn the_page_lists_every_case() {
    let listed = done(&["conform", "--list", "--json"]).json();
    let page = page("conformance.md");
    for case in listed["cases"].as_array().unwrap() {
        let cell = |name: &str| case[name].as_str().unwrap().to_owned();
        let row = format!("| {} | {} | {} |", cell("id"), cell("title"), cell("clause"));
        assert!(page.contains(&row), "docs/conformance.md lacks: {row}");
    }
    let (cases, _) = page.split_once("## A suite that can fail").unwrap();
    let rows = cases.lines().filter(|line| line.starts_with("| ") && line.contains("| CiA ")).count();
    assert_eq!(rows, listed["cases"].as_array().unwrap().len(), "no other cases are listed");
}
