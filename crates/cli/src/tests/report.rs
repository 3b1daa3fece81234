//! `ferrodrive report`: the page and its figures, on a bus that goes on.

use std::time::Duration;

use processes::scratch;
use serde_json::{Value, json};

use super::virtual_bus::VirtualBus;

/// The objects of a list of rows.
fn objects(rows: &Value) -> Vec<&str> {
    rows.as_array().expect("a list").iter().filter_map(|row| row["object"].as_str()).collect()
}

#[test]
fn what_was_changed_since_delivery_is_listed_and_nothing_else() {
    let bench = VirtualBus::of(&["zlac8030l@4"]).with(&["--model", "4=zlac8030l"]);
    let folder = scratch("report_differences");
    let [fresh, changed] = ["fresh.html", "changed.html"].map(|name| folder.path(name));
    let report = bench.json(&["report", "4", "-o", &fresh]);
    assert_eq!((&report["differences"], &report["fault"]), (&json!([]), &Value::Null), "{report:#}");
    assert!(report["compared"].as_u64() > Some(20), "{report:#}");

    bench.done(&["write", "4", "maximum_speed_of_motor", "800"]);
    let journal = folder.path("node4.journal");
    bench.done(&["pdo", "apply", "4", "tpdo1=statusword", "--type", "1", "--journal", &journal]);
    let report = bench.json(&["report", "4", "-o", &changed, "--by", "A. Fitter & <Co>"]);
    let differences = objects(&report["differences"]);
    assert_eq!(differences, ["1800h:02", "1A00h:00", "1A00h:01", "200Ah:00"], "{report:#}");
    let row = &report["differences"][3];
    assert_eq!((&row["name"], &row["first"]["text"]), (&"maximum_speed_of_motor".into(), &"800 r/min".into()), "{row}");
    assert_eq!(report["pdos"][0]["objects"][0]["name"], "statusword");
    let page = std::fs::read_to_string(&changed).unwrap();
    for part in [
        "A. Fitter &amp; &lt;Co&gt;",
        "<td>maximum_speed_of_motor</td><td>800 r/min</td><td>1000 r/min</td>",
        "@page{size:A4",
    ] {
        assert!(page.contains(part), "{part}: {page}");
    }
    // It needs nothing else: no script, no file, no address.
    for part in ["<script", "<link", "src=", "url(", "@import"] {
        assert!(!page.contains(part), "{part}");
    }
}

/// ZLAC8030L: 2000h is 1000 ms as delivered (quick start guide, chapter 9). The ZLIM42-C has no watch over its host (user manual, 5.4).
#[test]
fn guard_limits_and_a_fault_are_reported_as_the_model_has_them() {
    let (bench, folder) = (VirtualBus::of(&["zlac8030l@4", "zlim42c@2"]), scratch("report_guard"));
    bench.apply(4, "fault hall on");
    bench.pass(Duration::from_secs(1));
    let wheel = bench.json(&["report", "4", "-o", &folder.path("wheel.html")]);
    assert_eq!(wheel["guard"]["stops"], true, "{wheel:#}");
    assert!(wheel["guard"]["text"].as_str().is_some_and(|text| text.contains("1000 ms") && text.contains("2000h")));
    assert!(objects(&wheel["limits"]).contains(&"200Ah:00"), "{wheel:#}");
    // Two models answer this identity, and no one has said which it is.
    assert_eq!(wheel["identity"][0]["name"], "Model not certain", "{wheel:#}");
    let names = wheel["fault"]["names"].as_array().expect("a fault");
    assert!(!names.is_empty() && !wheel["fault"]["remedies"][0].as_str().unwrap_or_default().is_empty(), "{wheel:#}");
    let page = std::fs::read_to_string(folder.path("wheel.html")).unwrap();
    assert!(page.contains(&format!("Present: {:04X}h", wheel["fault"]["code"].as_u64().unwrap())), "{page}");

    let stepper = bench.json(&["report", "2", "-o", &folder.path("stepper.html")]);
    assert_eq!((&stepper["guard"]["stops"], &stepper["fault"]), (&false.into(), &Value::Null), "{stepper:#}");
    assert!(std::fs::read_to_string(folder.path("stepper.html")).unwrap().contains("<b>Goes on</b>"));
}

#[test]
fn a_capture_is_drawn_with_the_figures_of_this_node() {
    let (bench, folder) = (VirtualBus::of(&["zlac8030l@4"]), scratch("report_capture"));
    let whole = "t_s,4.velocity_rpm,5.velocity_rpm,mark\n0,0,7,\n0.1,10,7,\n0.2,50,7,\n0.3,-20,7,\n";
    let (record, page) = (folder.write("run.csv", whole), folder.path("report.html"));
    let report = bench.json(&["report", "4", "-o", &page, "--capture", &record]);
    let figures = json!([{ "name": "Velocity, actual", "unit": "r/min", "min": -20, "mean": 10, "max": 50 }]);
    let found = &report["captures"][0];
    assert_eq!(found["file"], "run.csv");
    let as_float = |value: &Value| serde_json::from_str::<Value>(&value.to_string().replace(".0", "")).unwrap();
    assert_eq!(as_float(&found["figures"]), figures);
    let page = std::fs::read_to_string(&page).unwrap();
    assert!(found["cut_off"] == false && !page.contains("The end of this record is missing"), "{found}");
    assert!(page.contains("<figure><svg") && page.contains("-20.000 r/min") && !page.contains("5.velocity"), "{page}");

    // As a power failure leaves it: its last line is not whole.
    let (torn, page) = (folder.write("torn.csv", &whole[..whole.len() - 2]), folder.path("torn.html"));
    let report = bench.json(&["report", "4", "-o", &page, "--capture", &torn]);
    let found = &report["captures"][0];
    assert!(found["cut_off"] == true && found["figures"][0]["min"].as_f64() == Some(0.0), "{found}");
    assert!(std::fs::read_to_string(&page).unwrap().contains("The end of this record is missing"));
}

#[test]
fn what_cannot_be_reported_is_refused_and_no_file_is_left() {
    let (bench, folder) = (VirtualBus::of(&["zlac8030l@4"]), scratch("report_refused"));
    let page = folder.path("report.html");
    let other = folder.write("other.csv", "t_s,5.velocity_rpm,mark\n0,7,\n0.1,7,\n");
    bench.refused(&["report", "9", "-o", &page], &["node 9 did not answer", "check its node-ID"]);
    bench.refused(
        &["report", "4", "-o", &page, "--capture", &other],
        &["has nothing of node 4", "a record of this node"],
    );
    bench.refused(&["report", "4", "-o", &page, "--capture", "/no/such.csv"], &["cannot read the record /no/such.csv"]);
    bench.refused(&["report", "4", "-o", "/no/such/folder/a.html"], &["cannot write", "its folder exists"]);
    let ended = bench.run(&["report", "4", "-o", "report.pdf"]);
    assert!(ended.status == Some(2) && ended.err.contains("expected FILE.html"), "{}", ended.err);
    assert!(!std::path::Path::new(&page).exists());
    let before = folder.write("report.html", "mine");
    bench.refused(&["report", "4", "-o", &before], &["already exists", "--force"]);
    assert_eq!(std::fs::read_to_string(&before).unwrap(), "mine");
    bench.done(&["report", "4", "-o", &before, "--force"]);
    assert!(std::fs::read_to_string(&before).unwrap().starts_with("<!doctype html>"));
}
