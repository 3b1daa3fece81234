//! Records of scenarios, and what is refused of them.

use std::path::Path;

use processes::{done, ferrodrive, scratch};
use recording::{Kind, Recorded, read};

fn recorded(path: &Path) -> Recorded {
    let kind = Kind::of_name(path.to_str().unwrap()).unwrap();
    read(kind, &std::fs::read(path).unwrap()).unwrap()
}

/// The time of the last sample.
fn last(recorded: &Recorded) -> f64 {
    recorded.series.first().and_then(|series| series.points.last()).map_or(0.0, |(at, _)| *at)
}

#[test]
fn a_picture_overwrites_only_a_picture() {
    let place = scratch("plots");
    let csv = place.join("run.csv");
    let text = "t_s,4.velocity_rpm,4.velocity_demand_rpm,5.current_a,mark\n0,0,0,1,\n1,60,60,1.5,node 4: started\n";
    std::fs::write(&csv, text).unwrap();
    let csv = csv.to_str().unwrap();
    for _ in 0..2 {
        let html = place.join("run.html");
        let drawn = done(&["plot", csv, "--html", html.to_str().unwrap(), "--json"]).json();
        assert_eq!((&drawn["signals"], &drawn["marks"]), (&3.into(), &1.into()), "{drawn}");
        let page = std::fs::read_to_string(html).unwrap();
        assert!(page.contains("Velocity") && page.contains("started") && page.ends_with("</html>\n"));
    }
    let letter = place.join("letter.svg");
    std::fs::write(&letter, "Dear reader").unwrap();
    let refused = |arguments: &[&str], parts: &[&str]| {
        let ended = ferrodrive(arguments);
        assert!(ended.status != Some(0), "{arguments:?}");
        for part in parts {
            assert!(ended.err.contains(part), "{arguments:?}: {part:?} in {}", ended.err);
        }
    };
    refused(&["plot", csv, "--svg", letter.to_str().unwrap()], &["cannot write the picture", "choose another name"]);
    assert_eq!(std::fs::read(&letter).unwrap(), b"Dear reader");
    refused(&["plot", csv, "--signals", "velocty_rpm"], &["did you mean velocity_rpm"]);
    refused(&["plot", csv, "--from", "5"], &["recorded from 0.000 s to 1.000 s"]);
    refused(&["plot", csv, "--from", "1", "--to", "0.5"], &["--to is before --from"]);
    refused(&["plot", csv, "--subtract"], &["two records or more", "--subtract"]);
    refused(&["plot", letter.to_str().unwrap()], &["NAME.mcap or NAME.csv"]);
    refused(&["plot", "/nowhere/run.mcap"], &["cannot read the record"]);
    let wrong = place.join("wrong.mcap");
    std::fs::write(&wrong, text).unwrap();
    refused(&["plot", wrong.to_str().unwrap()], &["not an MCAP file"]);
}

#[test]
fn a_record_is_asked_for_in_words_that_make_sense() {
    let refused = |arguments: &[&str], part: &str| {
        let ended = ferrodrive(&[&["sim", "--drive", "zlac8030l@4"], arguments].concat());
        assert_eq!(ended.status, Some(2), "{arguments:?}");
        assert!(ended.err.contains(part), "{arguments:?}: {part:?} in {}", ended.err);
    };
    refused(&["--record", "run.txt"], "NAME.mcap or NAME.csv");
    refused(&["--record", "run.csv", "--record-period", "1us"], "expected 50us or more: a control period");
    refused(&["--record-period", "1ms"], "--record <FILE>");
    let place = scratch("refused-record");
    let csv = place.join("run.csv");
    refused(&["--record", csv.to_str().unwrap(), "--record-signals", "5.*"], "unknown signal '5.*'");
    assert!(!csv.exists());
}

#[test]
fn a_scenario_that_is_recorded_is_the_same_run() {
    let place = scratch("recorded-scenario");
    let scenario = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/scenarios/brown_out.toml");
    let plain = done(&["run", scenario, "--json"]).json();
    for name in ["run.mcap", "run.csv"] {
        let path = place.join(name);
        let record = ["run", scenario, "--json", "--record", path.to_str().unwrap(), "--record-period", "500us"];
        let recording = done(&record).json();
        assert!(plain["digest"] == recording["digest"] && !plain["digest"].is_null(), "{name}: {plain}");
        let recorded = recorded(&path);
        assert!(!recorded.torn && !recorded.series.is_empty(), "{name}");
        let end = recorded.series[0].points.len() as f64 * 0.0005;
        assert!((last(&recorded) - end).abs() < 0.001, "{name}: no sample is missing");
        // The brown-out is among what happened.
        assert!(recorded.marks.iter().any(|mark| mark.text.contains("under-voltage")), "{name}: {:?}", recorded.marks);
    }
    let both = ferrodrive(&["run", scenario, "--seeds", "1..3", "--record", place.join("a.csv").to_str().unwrap()]);
    assert!(both.status == Some(2) && both.err.contains("a sweep has many"), "{}", both.err);
}

#[test]
fn a_record_says_how_a_drive_turned_and_what_was_done_to_it() {
    let place = scratch("recorded-turn");
    let scenario = place.join("turn.toml");
    let text = "machine = { drive = [{ model = 'zlac8030l', node = 4 }] }\nend = '6s'\n\
                [[host]]\ndo = ['4 enable', '4 move by 360deg at 60rpm']\n\
                [[step]]\nat = '5s'\ndo = '4 load torque 0.5'\n";
    std::fs::write(&scenario, text).unwrap();
    for name in ["run.mcap", "run.csv"] {
        let path = place.join(name);
        done(&["run", scenario.to_str().unwrap(), "--record", path.to_str().unwrap()]);
        let recorded = recorded(&path);
        assert!(!recorded.torn, "{name}");
        let of = |wanted: &str| {
            let found = recorded.series.iter().find(|series| series.column.name() == wanted);
            &found.unwrap_or_else(|| panic!("{wanted} in {name}")).points
        };
        // A turn has 4096 counts, and the drive measures within a count of where it is.
        let (_, position) = of("4.position_counts").iter().rev().find(|(at, _)| *at <= 4.9).unwrap();
        assert!((position - 4096.0).abs() < 8.0, "{name}: {position}");
        let fastest = of("4.velocity_rpm").iter().map(|(_, rpm)| *rpm).fold(0.0, f64::max);
        assert!((50.0..70.0).contains(&fastest), "{name}: {fastest} r/min");
        // A sample each millisecond, none missing, none twice.
        let steps = of("4.supply_v").windows(2).map(|pair| ((pair[1].0 - pair[0].0) * 1e6).round() as i64);
        assert!(steps.into_iter().all(|micros| micros == 1000), "{name}");
        let mark = recorded.marks.iter().find(|mark| mark.text.contains("load torque 0.5")).expect(name);
        assert!((mark.at.as_secs_f64() - 5.0).abs() < 0.002, "{name}: {mark:?}");
    }
}

#[test]
fn a_body_is_recorded_with_what_it_does() {
    let place = scratch("recorded-body");
    let scenario = place.join("base.toml");
    let text = r#"
title = "A base that is driven"
end = "3s"

[[machine.drive]]
model = "zlac8030l"
node = 4

[[machine.drive]]
model = "zlac8030l"
node = 5

[[machine.body]]
name = "base"
kind = "common-shaft"
drives = [4, 5]

[[step]]
at = "1s"
do = "4 load torque -1"
"#;
    std::fs::write(&scenario, text).unwrap();
    let csv = place.join("run.csv");
    done(&["run", scenario.to_str().unwrap(), "--record", csv.to_str().unwrap(), "--record-signals", "base.*"]);
    let recorded = recorded(&csv);
    let names: Vec<String> = recorded.series.iter().map(|series| series.column.name()).collect();
    assert_eq!(names, ["base.angle_deg", "base.speed_rpm"]);
    let units: Vec<&str> = recorded.series.iter().map(|series| &*series.column.unit).collect();
    assert_eq!(units, ["°", "r/min"]);
    let fastest = recorded.series[1].points.iter().map(|(_, rpm)| *rpm).fold(0.0, f64::max);
    assert!(fastest > 10.0, "the load turns it: {fastest} r/min");
}

#[test]
fn the_energies_of_a_driven_shaft_fit_together() {
    let place = scratch("recorded-energies");
    // Model, node-ID, load, how it is turned, gear.
    let drives = [
        ("zlac8030l", 4, "1.5", "4 velocity 60rpm", 1.0),
        ("zlim42c", 2, "0.1", "2 velocity 120rpm", 1.0),
        ("m4230e17b50", 1, "5", "1 velocity 600rpm", 50.0),
    ];
    for (model, node, load, turn, ratio) in drives {
        let scenario = place.join(format!("{model}.toml"));
        let text = format!(
            "title = \"A load that is driven\"\nend = \"3s\"\n[machine]\ntiming = \"ideal\"\ndrive = [{{ model = \"{model}\", node = {node} }}]\n\
             [[host]]\ndo = [\"{turn}\", \"wait 1s\"]\n[[step]]\nat = \"1200ms\"\ndo = \"{node} load torque {load}\"\n"
        );
        std::fs::write(&scenario, text).unwrap();
        // As CSV: in MCAP values are rounded.
        let path = place.join(format!("{model}.csv"));
        done(&["run", scenario.to_str().unwrap(), "--record", path.to_str().unwrap()]);
        let recorded = recorded(&path);
        let of = |signal: &str| -> Vec<(f64, f64)> {
            let name = format!("{node}.{signal}");
            let found = recorded.series.iter().find(|series| series.column.name() == name);
            found.unwrap_or_else(|| panic!("{name}")).points.clone()
        };
        let out = [
            "electronics_energy_j",
            "winding_heat_j",
            "switches_heat_j",
            "bleeder_heat_j",
            "friction_heat_j",
            "load_work_j",
        ];
        let mut rest = of("source_energy_j");
        for signal in out.into_iter().chain(["stored_energy_j"]) {
            rest.iter_mut().zip(of(signal)).for_each(|(rest, (_, joules))| rest.1 -= joules);
        }
        let through = of("source_energy_j").last().unwrap().1;
        let worst = rest.iter().map(|(_, missing)| (missing - rest[0].1).abs()).fold(0.0, f64::max);
        assert!(through > 5.0 && worst < 1e-3 * through, "{model}: {worst} J missing of {through} J");
        // From when the load pulls until the end, whatever the drive does meanwhile: work is torque times way.
        let under_load = |signal: &str| -> f64 {
            let values: Vec<f64> = of(signal).iter().filter(|(at, _)| *at >= 1.25).map(|(_, value)| *value).collect();
            values.last().unwrap() - values[0]
        };
        let load_nm: f64 = load.parse().unwrap();
        let (of_load, done_j) = (load_nm * under_load("load_angle_rad"), under_load("load_work_j"));
        assert!(
            of_load > 0.1 && (done_j - of_load).abs() < 1e-3 * of_load,
            "{model}: {of_load} J, {done_j} J recorded"
        );
        let way_rad = under_load("shaft_angle_rad");
        assert!((under_load("load_angle_rad") * ratio - way_rad).abs() < 0.02 * way_rad.abs(), "{model}: the gear");
    }
}

#[test]
fn the_page_tells_of_every_signal_with_its_unit() {
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/recording.md")).unwrap();
    for signal in sim::recorder::Signal::ALL {
        let unit = if signal.unit().is_empty() { String::new() } else { format!(" {}", signal.unit()) };
        let row = format!("| `{}` |{unit} | ", signal.name());
        assert!(page.contains(&row), "{row}");
    }
}

#[test]
fn a_capture_is_a_record_with_what_belongs_to_it_and_says_how_it_was_had() {
    let place = scratch("captures");
    let file = place.join("step.mcap");
    let name = file.to_str().unwrap();
    let words = ["capture", "4", "velocity", "target_velocity", "--for", "200ms", "--notes", "cold", "-o", name];
    let report = done(&[&words[..], &["--json"]].concat()).json();
    let traces = report["captures"][0]["traces"].as_array().unwrap();
    assert_eq!((&report["pace"], traces.len()), (&"event timer".into(), 2), "{report}");
    for trace in traces {
        assert_eq!((&trace["by"], &trace["period_s"], &trace["gaps"]), (&"TPDO1".into(), &0.001.into(), &0.into()));
    }
    let capture = recording::Capture::of(&recorded(&file), None).unwrap();
    assert_eq!((capture.name.as_str(), capture.notes.as_str()), ("step", "cold"));
    assert!(capture.model == "zlac8030l" && !capture.parameters.is_empty() && !capture.is_cut_off);
    let drawn = done(&["plot", name, "-o", "-", "--json"]).json();
    assert!(!drawn["picture"].as_str().unwrap().contains("capture {"), "the description is not an event");
    // What was on the wire meanwhile, in two forms: the least and the most of each object are those of its trace.
    let (log, blf) = (place.join("wire.log"), place.join("wire.blf"));
    let (log, blf) = (log.to_str().unwrap(), blf.to_str().unwrap());
    done(&["capture", "4", "supply", "--for", "100ms", "--log", log, "--json"]);
    done(&["convert", log, blf]);
    let page = place.join("page.html");
    let of = |log: &str| {
        let words = ["report", "4", "--capture", log, "-o", page.to_str().unwrap(), "--force", "--json"];
        done(&words).json()["captures"][0]["figures"].clone()
    };
    let (figures, of_blf) = (of(log), of(blf));
    assert_eq!(figures, of_blf);
    // Its source is set to 48 V.
    assert!(figures.as_array().is_some_and(|all| all.len() == 1) && figures[0]["mean"] == 48.0, "{figures}");
    let drawn = done(&["plot", blf, "--model", "4=zlac8030l", "-o", "-", "--json"]).json();
    assert!(drawn["signals"].as_u64() > Some(0), "{drawn}");
    let refused = ferrodrive(&["capture", "1", "velocity"]);
    assert!(
        refused.status == Some(1) && refused.err.contains("is fixed") && refused.err.contains("--sdo"),
        "{}",
        refused.err
    );
}

#[test]
fn a_file_of_others_under_one_of_the_names_is_seen_before_anything_is_captured_or_moved() {
    let place = scratch("captures-of-others");
    let [name, second] = ["step.csv", "step-2.csv"].map(|name| place.join(name));
    std::fs::write(&second, "name,price\n").unwrap();
    let file = name.to_str().unwrap();
    let motion = ["test-motion", "4", "steps", "--speed", "60rpm", "--time", "500ms"];
    for words in [&["capture", "4", "velocity", "--for", "20ms"][..], &motion] {
        let refused = ferrodrive(&[words, &["--count", "2", "-o", file]].concat());
        assert_eq!(refused.status, Some(1), "{words:?}: {}", refused.err);
        assert!(refused.err.contains("step-2.csv") && refused.err.contains("not a record"), "{}", refused.err);
        // The first capture was not taken.
        assert!(!name.exists(), "{words:?}");
    }
    let in_a_file = second.join("step.csv");
    let refused = ferrodrive(&["capture", "4", "velocity", "-o", in_a_file.to_str().unwrap()]);
    assert!(refused.status == Some(1) && refused.err.contains("cannot write the capture"), "{}", refused.err);
    assert_eq!(std::fs::read_to_string(&second).unwrap(), "name,price\n");
}

#[test]
fn a_test_motion_is_judged_by_what_was_sampled() {
    let report =
        done(&["test-motion", "4", "steps", "--speed", "60rpm", "--time", "1s", "--count", "2", "--json"]).json();
    let runs = report["runs"].as_array().unwrap();
    assert_eq!(runs.len(), 2);
    for run in runs {
        let steps = run["steps"].as_array().unwrap();
        assert_eq!((&steps[0]["to"], &steps[1]["to"]), (&60.0.into(), &0.0.into()), "{run}");
        // The ramp as delivered, 500 ms (6083h): 80 % of it from 10 % to 90 %.
        let rise = steps[0]["rise_s"]["value"].as_f64().unwrap_or_else(|| panic!("{run}"));
        assert!((0.2..0.6).contains(&rise), "{rise}");
        assert!(run["heating"]["rms_a"].as_f64().unwrap() > 0.0);
    }
    let refused = ferrodrive(&["test-motion", "4", "sine", "--by", "90deg", "--frequency", "5"]);
    assert!(refused.status == Some(1) && refused.err.contains("are allowed"), "{}", refused.err);
}

/// On a bus of its own, where no other program moves the drive: after a minute of its time.
#[test]
fn a_trigger_that_does_not_come_is_not_waited_for_for_ever() {
    let place = scratch("captures-untriggered");
    let file = place.path("run.csv");
    let ended =
        ferrodrive(&["capture", "4", "velocity", "--trigger", "velocity > 10", "--for", "50ms", "-o", &file, "--json"]);
    let failure = ended.json();
    assert_eq!(
        (ended.status, &failure["error"]["kind"]),
        (Some(1), &"no_trigger".into()),
        "{} {}",
        ended.out,
        ended.err
    );
    assert!(!Path::new(&file).exists());
}

#[test]
fn captures_are_taken_as_often_as_was_asked_for_each_into_a_file_of_its_own() {
    let place = scratch("captures-counted");
    let [first, second] = ["run.csv", "run-2.csv"].map(|name| place.path(name));
    let report = done(&["capture", "4", "supply", "--for", "50ms", "--count", "2", "-o", &first, "--json"]).json();
    assert_eq!([&report["captures"][0]["file"], &report["captures"][1]["file"]], [first.as_str(), second.as_str()]);
    for (path, name) in [(&first, "run"), (&second, "run-2")] {
        let capture = recording::Capture::of(&recorded(Path::new(path)), None).unwrap();
        let [from, to] = [capture.time_s[0], capture.time_s[capture.time_s.len() - 1]];
        assert!(capture.name == name && from == 0.0 && (to - 0.05).abs() < 2e-3, "{} {from} {to}", capture.name);
    }
    // Both in one picture, with the trigger at 0, which these have not.
    let drawn = done(&["plot", &first, &second, "-o", "-", "--json"]).json();
    let picture = drawn["picture"].as_str().unwrap();
    assert!(picture.contains("actual, run.csv") && picture.contains("actual, run-2.csv"), "{drawn}");
    assert_eq!((&drawn["records"][1], &drawn["signals"]), (&second.as_str().into(), &2.into()));
    let drawn = done(&["plot", &second, &first, "--subtract", "-o", "-", "--json"]).json();
    let picture = drawn["picture"].as_str().unwrap();
    assert!(picture.contains("run-2.csv less run.csv") && drawn["signals"] == 1, "{drawn}");
    let other = place.path("other.csv");
    std::fs::write(&other, "t_s,7.velocity_rpm\n0,0\n0.05,1\n").unwrap();
    let refused = ferrodrive(&["plot", &first, &other, "--subtract", "-o", "-"]);
    assert!(refused.status == Some(1) && refused.err.contains("no signal in common"), "{}", refused.err);
    std::fs::write(&other, std::fs::read_to_string(&first).unwrap().replace("\n0", "\n9")).unwrap();
    let refused = ferrodrive(&["plot", &first, &other, "--subtract", "-o", "-"]);
    assert!(refused.status == Some(1) && refused.err.contains("no time in common"), "{}", refused.err);
    let refused = ferrodrive(&["plot", &first, &second, "--align", "trigger", "-o", "-"]);
    assert!(refused.status == Some(1) && refused.err.contains("run.csv has no trigger"), "{}", refused.err);
}

/// A raised cosine of 20 degrees in one second, captured of another drive: that is named, and its way is gone all the same.
#[test]
fn a_shaft_is_moved_along_the_position_of_a_capture_and_one_of_another_drive_is_named() {
    let place = scratch("moved-along");
    let row = |n: u32| {
        let at = f64::from(n) * 0.01;
        format!("{at:.2},{:.6}\n", 10.0 * (1.0 - (std::f64::consts::TAU * at).cos()))
    };
    let values: String = (0..=100).map(row).collect();
    for (node, others) in [(4, 0), (5, 1)] {
        let path = place.write("path.csv", &format!("t_s,{node}.position_deg\n{values}"));
        let words = ["test-motion", "4", "path", "--path", &path, "--capture", "position", "--json"];
        let report = done(&words).json();
        let (run, notes) = (&report["runs"][0], report["notes"].as_array().unwrap());
        assert!((run["followed"]["took_s"].as_f64().unwrap() - 1.0).abs() < 0.05, "{run}");
        let trace = &run["capture"]["traces"][0];
        let [least, most] = [&trace["least"], &trace["most"]].map(|value| value.as_f64().unwrap());
        assert!((most - 20.0).abs() < 1.0 && least.abs() < 1.0, "{trace}");
        assert_eq!(notes.len(), others, "{report}");
        assert!(notes.iter().all(|note| note.as_str().unwrap().contains("of node 5, and node 4")), "{report}");
    }
}

#[test]
fn options_of_tune_that_have_no_effect_on_a_drive_are_refused() {
    for (node, option, value) in [
        ("2", "--loop", "position"),
        ("2", "--current", "3A"),
        ("2", "--bandwidth", "20"),
        ("2", "--travel", "3turn"),
        ("4", "--load-inertia", "3e-5"),
        ("4", "--ramp", "200ms"),
    ] {
        let ended = ferrodrive(&["tune", node, option, value]);
        assert_eq!(ended.status, Some(2), "{option}: {}", ended.out);
        assert!(ended.err.contains(&format!("{option} has no effect on a")), "{}", ended.err);
    }
}

#[test]
fn a_tuning_and_a_test_motion_are_in_the_report_of_their_node() {
    let place = scratch("tuned-report");
    let [tune, step, page, picture] = ["tune.json", "step.mcap", "page.html", "tune.svg"].map(|name| place.path(name));
    let tuned = done(&["tune", "4", "--loop", "position", "--picture", &picture, "--json"]);
    std::fs::write(&tune, &tuned.out).unwrap();
    let tuned = tuned.json();
    // The picture, and the rows of it: what was measured, the model and the twin, with their coherence.
    let drawn = std::fs::read_to_string(&picture).unwrap();
    assert!(
        ["coherence", "Hz", "Bode", "Frequency response"].iter().filter(|part| drawn.contains(**part)).count() >= 3
    );
    let rows = tuned["response"].as_array().unwrap();
    let coherent = rows.iter().filter(|row| row["coherence"].as_f64() >= Some(0.5)).count();
    assert_eq!(
        (Some(coherent as u64), Some(rows.len() as u64)),
        (tuned["coherent"].as_u64(), tuned["frequencies"].as_u64())
    );
    assert!(rows.windows(2).all(|pair| pair[0]["hz"].as_f64() < pair[1]["hz"].as_f64()), "ascending");
    // A bare wheel: the median of the coherent rows is where the twin is, by as much as is said.
    assert!(tuned["twin_move"][1]["settled_s"].as_f64() > Some(0.7), "{}", tuned["twin_move"]);
    done(&["test-motion", "4", "steps", "--speed", "60rpm", "--time", "700ms", "-o", &step]);
    let words = ["report", "4", "--tune", &tune, "--capture", &step, "-o", &page, "--json"];
    let report = done(&words).json();
    assert_eq!(report["tunings"][0]["gains"], tuned["gains"]);
    let merit = &report["captures"][0]["merit"];
    assert_eq!((&merit["steps"][0]["to"], &merit["steps"][1]["to"]), (&60.0.into(), &0.0.into()), "{merit}");
    let page = std::fs::read_to_string(&page).unwrap();
    let gain = &tuned["gains"][0];
    for part in ["Tuning", "rise, 0 to 60 r/min", "r.m.s.", "speed_proportional_gain_kp", &gain["after"].to_string()] {
        assert!(page.contains(part), "{part}");
    }
    // That of another node, and what is not one.
    for (node, path, why) in [("5", &tune, "it is of node 4 (zlac8030l)"), ("4", &step, "it is not JSON")] {
        let refused = ferrodrive(&["report", node, "--tune", path, "-o", &place.path("other.html")]);
        assert!(refused.status == Some(1) && refused.err.contains(why), "{}", refused.err);
    }
}
