//! The commands of `docs/handbook`, and of the pages beside it, as a reader would type them: each ends well, and each line for a
//! simulator's terminal is answered. They are in the project's folder, not in the package.

use std::path::{Path, PathBuf};

use processes::{Simulator, command, scratch};

/// The port that the pages print; here it is a free one.
const PRINTED_PORT: &str = "29536";

/// Lines that are not our commands: checked elsewhere, or of another program.
const OTHERS: &[&str] = &["cargo ", "git ", "pip ", "#"];

/// A bus that is not there.
const REAL_BUS: &str = "--bus can0";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn page(name: &str) -> String {
    let path = root().join("docs/handbook").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The blocks of a page with their languages.
fn blocks(text: &str) -> Vec<(&str, Vec<&str>)> {
    let mut found = Vec::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if let Some(language) = line.strip_prefix("```") {
            found.push((language, lines.by_ref().take_while(|line| !line.starts_with("```")).collect()));
        }
    }
    found
}

/// Does what a page says, from top to bottom; how many commands that were.
fn follow(name: &str) -> usize {
    // Files that a page names are those of the project.
    follow_in(name, &root())
}

/// The same in a folder, where a page's commands write files.
fn follow_in(name: &str, folder: &Path) -> usize {
    let text = page(name);
    let mut simulator: Option<(Simulator, String)> = None;
    let mut commands = 0;
    for (language, lines) in blocks(&text) {
        for line in lines.into_iter().filter(|line| !line.trim().is_empty()) {
            match (language, &mut simulator) {
                ("sh", _) if OTHERS.iter().any(|other| line.starts_with(other)) || line.contains(REAL_BUS) => {}
                ("sh", running) => {
                    let line = line.split(" #").next().unwrap_or_default();
                    let port = running.as_ref().map_or("0", |(_, port)| port);
                    let line = line.replace(PRINTED_PORT, port);
                    let words = words(&line);
                    let arguments = words.strip_prefix(&["ferrodrive"]).unwrap_or_else(|| panic!("{name}: {line}"));
                    if arguments[0] == "sim" {
                        let started = Simulator::start(&arguments[1..]);
                        let port = started.ready.rsplit(':').next().unwrap_or_default().to_owned();
                        *running = Some((started, port));
                    } else {
                        let ended = command(arguments).current_dir(folder).output().expect("the binary runs");
                        assert!(ended.status.success(), "{name}: {line}: {}", String::from_utf8_lossy(&ended.stderr));
                    }
                    commands += 1;
                }
                ("text", Some((simulator, _))) => {
                    let answer = simulator.ask(line);
                    assert_eq!(answer["ok"], true, "{name}: {line}: {answer}");
                    commands += 1;
                }
                // A block without a language is not run: a command in it would be true by luck.
                ("", _) => assert!(!line.starts_with("ferrodrive "), "{name}: not in a block of sh: {line}"),
                _ => {}
            }
        }
    }
    commands
}

/// The words of a line, of which one may stand in quotation marks.
fn words(line: &str) -> Vec<&str> {
    let parts = line.split('\'').enumerate();
    parts.flat_map(|(n, part)| if n % 2 == 1 { vec![part] } else { part.split_whitespace().collect() }).collect()
}

/// The pages beside the handbook whose commands are run here, and how many they are.
const DOCS_FOLLOWED: [(&str, usize); 3] = [("../eds.md", 6), ("../machine-file.md", 2), ("../conformance.md", 3)];

/// Those whose commands are not run here, and why.
const DOCS_NOT_FOLLOWED: [(&str, &str); 4] = [
    (
        "../control.md",
        "its servers end with a signal, and clients speak to them: crates/cli/tests/command_line, simulator.rs",
    ),
    ("../performance.md", "its commands measure this machine"),
    ("../recording.md", "its record ends with a simulator: recording.rs, crates/cli/tests/command_line/recording.rs"),
    (
        "../scenarios.md",
        "a thousand runs, and a host outside: crates/cli/tests/command_line/{run,sweep}.rs, run_served.rs",
    ),
];

/// The pages whose commands are run here, and how many they are.
const FOLLOWED: [(&str, usize); 18] = [
    ("another-maker.md", 8),
    ("install.md", 2),
    ("first-steps.md", 18),
    ("simulate.md", 14),
    ("ci.md", 1),
    ("test-your-software.md", 10),
    ("logs.md", 11),
    ("configure-a-drive.md", 14),
    ("two-axes-from-a-test.md", 0),
    ("add-an-object.md", 0),
    ("add-a-drive.md", 2),
    ("ros2-canopen.md", 3),
    ("write-a-scenario.md", 2),
    ("plan-a-bus.md", 2),
    ("why-it-does-not-move.md", 3),
    ("start-up.md", 2),
    ("several-axes.md", 6),
    ("foxglove.md", 1),
];

/// The pages whose commands are not run here, and why.
const NOT_FOLLOWED: [(&str, &str); 15] = [
    ("adapters.md", "in virtual time: crates/cli/src/tests/pages.rs"),
    ("lss.md", "in virtual time: crates/cli/src/tests/pages.rs"),
    ("README.md", "the list of the pages"),
    ("canopen-python.md", "its programs are crates/python/tests/test_canopen_python.py"),
    ("faq.md", "it has no commands"),
    ("fmu.md", "it packs a library that is built beside the program: tests/peers/fmu.py"),
    ("in-the-browser.md", "its page has a compiler of its own: cargo xtask test --only web"),
    ("library.md", "its command is cargo's: the examples' step"),
    ("gateway.md", "it serves until a signal, and a client speaks to it: gateway.rs"),
    ("physics-engine.md", "its programs are Python's: examples/mujoco, which holds the page to them"),
    ("python-can.md", "it has no commands: tests/peers"),
    ("socketcan.md", "it needs CAN interfaces of Linux: socketcan.rs, in a virtual machine"),
    ("studio.md", "it serves a browser: studio.rs, and tests/browser_and_schema"),
    ("sweeps.md", "its shards are made and merged: crates/cli/tests/command_line/sweep.rs"),
    ("top.md", "it draws on a terminal: top.rs"),
];

fn follows(name: &str, followed: usize) {
    let expected = FOLLOWED.iter().chain(&DOCS_FOLLOWED).find(|(page, _)| *page == name).map(|(_, count)| *count);
    assert_eq!(Some(followed), expected, "{name}");
}

#[test]
fn every_page_of_the_handbook_is_followed_or_it_is_said_why_not() {
    let folder = std::fs::read_dir(root().join("docs/handbook")).expect("the handbook is there");
    let files = folder.map(|entry| entry.expect("a readable folder").file_name().into_string().expect("a name"));
    let pages = files.filter(|name| name.ends_with(".md"));
    let known = FOLLOWED.iter().map(|(page, _)| *page).chain(NOT_FOLLOWED.iter().map(|(page, _)| *page));
    let known: std::collections::BTreeSet<_> = known.map(str::to_owned).collect();
    assert_eq!(pages.collect::<std::collections::BTreeSet<_>>(), known);
}

#[test]
fn every_page_beside_the_handbook_that_has_commands_is_followed_or_it_is_said_why_not() {
    let folder = std::fs::read_dir(root().join("docs")).expect("the pages are there");
    let files = folder.map(|entry| entry.expect("a readable folder").file_name().into_string().expect("a name"));
    let pages = files.filter(|name| name.ends_with(".md")).map(|name| format!("../{name}"));
    let has_commands = |name: &String| {
        blocks(&page(name)).iter().any(|(_, lines)| lines.iter().any(|line| line.starts_with("ferrodrive ")))
    };
    let known = DOCS_FOLLOWED.iter().map(|(page, _)| *page).chain(DOCS_NOT_FOLLOWED.iter().map(|(page, _)| *page));
    let known: std::collections::BTreeSet<_> = known.map(str::to_owned).collect();
    assert_eq!(pages.filter(has_commands).collect::<std::collections::BTreeSet<_>>(), known);
}

#[test]
fn every_command_of_the_pages_beside_the_handbook_ends_well() {
    let folder = scratch("docs_pages");
    let made = command(&["eds", "zlac8030l", "-o", &folder.path("vendor.eds")]).output().expect("the binary runs");
    assert!(made.status.success());
    follows("../eds.md", follow_in("../eds.md", &folder));
    follows("../conformance.md", follow_in("../conformance.md", &folder));
    // The machine of the section with these commands.
    let text = page("../machine-file.md");
    let units = text.split_once("## Units").expect("a section on units").1;
    let (_, lines) = &blocks(units)[0];
    std::fs::write(folder.join("FILE.toml"), lines.join("\n")).unwrap();
    follows("../machine-file.md", follow_in("../machine-file.md", &folder));
}

#[test]
fn every_command_of_the_page_on_testing_ends_well() {
    follows("test-your-software.md", follow("test-your-software.md"));
}

#[test]
fn every_command_of_the_page_on_logs_ends_well() {
    let folder = scratch("handbook_logs");
    follows("logs.md", follow_in("logs.md", &folder));
}

#[test]
fn every_command_of_the_page_on_other_makers_ends_well() {
    let folder = scratch("handbook_maker");
    follows("another-maker.md", follow_in("another-maker.md", &folder));
}

#[test]
fn every_command_of_the_page_on_parameters_ends_well() {
    let folder = scratch("handbook_params");
    std::fs::create_dir(folder.join("examples")).unwrap();
    for file in ["examples/machine.toml", "examples/base.toml"] {
        std::fs::copy(root().join(file), folder.join(file)).unwrap();
    }
    follows("configure-a-drive.md", follow_in("configure-a-drive.md", &folder));
}

#[test]
fn every_command_of_the_first_pages_ends_well() {
    // Some write files where they are run: manual pages, a report.
    let folder = scratch("handbook_first");
    std::fs::create_dir_all(folder.join("examples/scenarios")).unwrap();
    for file in ["examples/machine.toml", "examples/scenarios/brown_out.toml"] {
        std::fs::copy(root().join(file), folder.join(file)).unwrap();
    }
    follows("install.md", follow_in("install.md", &folder));
    follows("first-steps.md", follow_in("first-steps.md", &folder));
    follows("simulate.md", follow_in("simulate.md", &folder));
    follows("ci.md", follow_in("ci.md", &folder));
}

#[test]
fn every_command_of_the_other_pages_ends_well() {
    follows("two-axes-from-a-test.md", follow("two-axes-from-a-test.md"));
    follows("add-an-object.md", follow("add-an-object.md"));
    follows("add-a-drive.md", follow("add-a-drive.md"));
    follows("ros2-canopen.md", follow("ros2-canopen.md"));
    follows("write-a-scenario.md", follow("write-a-scenario.md"));
    follows("plan-a-bus.md", follow("plan-a-bus.md"));
    follows("why-it-does-not-move.md", follow("why-it-does-not-move.md"));
    follows("start-up.md", follow("start-up.md"));
    follows("several-axes.md", follow("several-axes.md"));
    follows("foxglove.md", follow("foxglove.md"));
}
