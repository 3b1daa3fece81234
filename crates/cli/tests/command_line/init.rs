//! `ferrodrive init`: the machine file to begin with. What a scan leaves open, and what follows for the file, is tested in
//! `crates/host/tests/it/init.rs`.

use processes::{Simulator, command, done, ferrodrive, scratch};

const MACHINE: &str = "bitrate = '250k'\n[[drive]]\nmodel = 'zlac8030l'\nnode = 4\noptions = { 1017 = 200 }\n\
    [[drive]]\nmodel = 'zlim42c-82'\nnode = 5\n[[drive]]\nmodel = 'm8025e25b80'\nnode = 3\n[[drive]]\nmodel = 'cia402'\nnode = 9\n";

#[test]
fn the_file_of_a_bus_passes_its_check_and_gives_the_same_scan() {
    let directory = scratch("init");
    let (source, made) = (directory.join("source.toml"), directory.join("made.toml"));
    std::fs::write(&source, MACHINE).unwrap();
    let (from, to) = (format!("sim:{}", source.display()), format!("sim:{}", made.display()));
    let said = done(&["--bus", &from, "init", "-o", made.to_str().unwrap()]).out;
    assert!(said.contains("4 drives") && said.contains("ferrodrive check"), "{said}");
    let checked = done(&["--json", "check", made.to_str().unwrap()]).json();
    assert_eq!((&checked["errors"], &checked["ok"]), (&0.into(), &true.into()), "{checked}");
    let scan = |bus: &str| done(&["--json", "--bus", bus, "scan"]).out;
    assert_eq!(scan(&to), scan(&from));
    // To standard output goes the same text, and in JSON.
    let file = std::fs::read_to_string(&made).unwrap();
    assert!(file.contains("bitrate = \"250k\""), "{file}");
    for words in [&["init"][..], &["init", "-o", "-"]] {
        assert_eq!(done(&[&["--bus", &from], words].concat()).out, file);
    }
    let json = done(&["--json", "--bus", &from, "init"]).json();
    assert_eq!((&json["toml"], &json["bitrate"]), (&file.as_str().into(), &250_000.into()));
    let nodes: Vec<_> = json["nodes"].as_array().unwrap().iter().map(|row| row["node"].clone()).collect();
    assert_eq!(nodes, [3, 4, 5, 9]);
}

#[test]
fn a_file_that_is_there_stays_unless_it_is_said_otherwise() {
    let directory = scratch("init_there");
    let file = directory.join("machine.toml");
    let path = file.to_str().unwrap();
    std::fs::write(&file, "# mine\n").unwrap();
    let line = ["--json", "init", "--drive", "zlac8030l@4", "-o", path];
    let refused = ferrodrive(&line);
    assert_eq!((refused.status, &refused.json()["error"]["kind"]), (Some(1), &"file_exists".into()));
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "# mine\n");
    done(&[&line[..], &["--force"]].concat());
    assert!(std::fs::read_to_string(&file).unwrap().contains("zlac8030l"));
    let wrong = ferrodrive(&["init", "--drive", "zlac8030l@4", "-o", "machine.yml"]);
    assert!(wrong.status == Some(2) && wrong.err.contains("FILE.toml"), "{}", wrong.err);
    let nowhere = ferrodrive(&["--json", "init", "--drive", "zlac8030l@4", "-o", "/no/such/folder/m.toml"]);
    assert_eq!((nowhere.status, &nowhere.json()["error"]["kind"]), (Some(1), &"file".into()));
}

#[test]
fn without_a_bus_the_drives_are_named_as_for_sim() {
    let directory = scratch("init_named");
    let file = directory.join("machine.toml");
    let path = file.to_str().unwrap();
    let drives = ["--drive", "zlac8030l@4,motor=fast,reading=L083:sync,2014=100", "--drive", "m4230e17b50@1"];
    done(&[&["init", "-o", path][..], &drives].concat());
    done(&["check", path]);
    let scanned = done(&["--json", "--bus", &format!("sim:{path}"), "scan"]).json();
    let models: Vec<_> =
        scanned["nodes"].as_array().unwrap().iter().map(|row| (row["node"].clone(), row["model"].clone())).collect();
    assert_eq!(models, [(1.into(), "m4230e17b50".into()), (4.into(), "zlac8030l".into())]);
    let stored = done(&["--json", "--bus", &format!("sim:{path}"), "read", "4", "2014"]).json();
    assert_eq!(stored["value"], 100);
    // A data sheet is looked for beside the machine file, wherever this was typed.
    let sheet = directory.join("servo.eds");
    done(&["eds", "cia402", "-o", sheet.to_str().unwrap()]);
    let named = format!("{}@7", sheet.display());
    done(&["init", "--drive", &named, "-o", path, "--force"]);
    done(&["check", path]);

    // The file of the environment may be the one that is to be written.
    let later = directory.join("later.toml");
    let mut line = command(&[&["init", "-o", later.to_str().unwrap()][..], &drives].concat());
    assert!(line.env("FERRODRIVE_MACHINE", &later).output().unwrap().status.success() && later.exists());

    let neither = ferrodrive(&["init"]);
    assert_eq!(neither.status, Some(2));
    assert!(neither.err.contains("--bus can0 init") && neither.err.contains("init --drive"), "{}", neither.err);
    let both = ferrodrive(&[&["--bus", "slcan://127.0.0.1:1", "init"][..], &drives].concat());
    assert_eq!(both.status, Some(2), "{}", both.err);
    let twice = ferrodrive(&["init", "--drive", "zlac8030l@4", "--drive", "zlim42c@4"]);
    assert!(twice.status == Some(2) && twice.err.contains("two drives at node 4"), "{}", twice.err);
}

#[test]
fn where_no_node_is_on_the_bus_no_file_is_written() {
    let directory = scratch("init_no_node");
    let (source, made) = (directory.join("source.toml"), directory.join("made.toml"));
    // A device that waits for its node-ID answers no SDO request (CiA 305).
    std::fs::write(&source, "[[drive]]\nmodel = 'cia402'\nnode = 9\noptions = { node-id = 'none' }\n").unwrap();
    let bus = format!("sim:{}", source.display());
    let ended = ferrodrive(&["--json", "--bus", &bus, "init", "-o", made.to_str().unwrap()]);
    assert_eq!((ended.status, &ended.json()["error"]["kind"]), (Some(1), &"no_node".into()), "{}", ended.out);
    assert!(!made.exists());
}

#[test]
fn where_there_is_no_terminal_nothing_is_asked_and_the_status_says_what_is_open() {
    let directory = scratch("init_alike");
    let made = directory.join("made.toml");
    let path = made.to_str().unwrap();
    let drives = ["--drive", "zlim42c-82@2", "--drive", "m8025e25b50@1", "--timing", "ideal"];
    let simulator = Simulator::start(&[&drives[..], &["--serve", "socketcand://127.0.0.1:0"]].concat());
    let bus = simulator.bus("socketcand");
    let ended = ferrodrive(&["--bus", &bus, "init", "-o", path]);
    assert_eq!(ended.status, Some(1), "{}", ended.err);
    assert!(ended.err.contains("1 of 2 drives") && ended.err.contains("--model 1=m4230e17b50"), "{}", ended.err);
    let file = std::fs::read_to_string(&made).unwrap();
    assert!(file.contains("model = \"zlim42c\"  # or zlim42c-82") && file.contains("#node = 1"), "{file}");
    assert!(file.contains("\n#bitrate = "), "a server does not say its bit rate: {file}");
    for (typed, written) in [(&[][..], "\nbitrate = \"500k\"\n"), (&["--bitrate", "1M"], "\nbitrate = \"1M\"\n")] {
        let named = done(&[&["init", "--drive", "zlac8030l@4"], typed].concat()).out;
        assert!(named.contains(written), "{named}");
    }
    let json = ferrodrive(&["--json", "--bus", &bus, "init"]);
    assert_eq!((json.status, &json.json()["error"]["kind"]), (Some(1), &"unknown_model".into()));
    let said = ["--model", "2=zlim42c-82", "--model", "1=m8025e25b50"];
    done(&[&["--bus", &bus, "init", "-o", path, "--force"][..], &said].concat());
    done(&["check", path]);
    let models = done(&["--json", "--machine", path, "--bus", &bus, "scan"]).json();
    assert_eq!(
        (&models["nodes"][0]["model"], &models["nodes"][1]["model"]),
        (&"m8025e25b50".into(), &"zlim42c-82".into())
    );
}

/// As the file is made, and with its example of a group in use: nothing to be warned of.
#[test]
fn the_file_of_two_of_any_model_passes_its_check_with_its_group_too() {
    let directory = scratch("init_group");
    for model in ["zlac8030l", "zlim42c", "m4230e17b50", "m8025e25b80", "cia402"] {
        let file = directory.join(format!("{model}.toml"));
        let (path, drives) = (file.to_str().unwrap(), [1, 2].map(|node| format!("{model}@{node}")));
        let text = done(&["init", "--drive", &drives[0], "--drive", &drives[1], "-o", "-"]).out;
        let (before, group) = text.split_once("#[[group]]").unwrap();
        let (group, after) = group.split_once("\n\n").unwrap();
        let grouped = format!("{before}[[group]]{}\n\n{after}", group.replace("\n#", "\n"));
        for text in [&text, &grouped] {
            std::fs::write(&file, text).unwrap();
            let checked = done(&["--json", "check", path]).json();
            assert_eq!(
                (&checked["errors"], &checked["warnings"]),
                (&0.into(), &0.into()),
                "{model}: {checked}\n{text}"
            );
        }
    }
}
