//! The commands of `docs/handbook`, as a reader would type them: each ends well, and each line for a simulator's terminal
//! is answered. They stand in the project's folder, not in the package.

use std::path::{Path, PathBuf};

use processes::{Simulator, command, scratch};

/// The port that the pages print; here it is a free one.
const PRINTED_PORT: &str = "29536";

/// A drive answers in time; the machine that simulates it in a test may be busy.
const PRINTED_LSS: &str = "can0 lss ";
const PATIENT_LSS: &str = "can0 lss --within 500ms ";

/// What is no command of ours: checked elsewhere, or another program's.
const OTHERS: &[&str] = &["cargo ", "git ", "pip ", "#"];

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
                ("sh", _) if OTHERS.iter().any(|other| line.starts_with(other)) => {}
                ("sh", running) => {
                    let line = line.split(" #").next().unwrap_or_default();
                    let port = running.as_ref().map_or("0", |(_, port)| port);
                    let line = line.replace(PRINTED_PORT, port).replace(PRINTED_LSS, PATIENT_LSS);
                    let words: Vec<&str> = line.split_whitespace().collect();
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
                _ => {}
            }
        }
    }
    commands
}

#[test]
fn every_command_of_the_page_on_testing_ends_well() {
    assert_eq!(follow("test-your-software.md"), 10);
}

#[test]
fn every_command_of_the_page_on_logs_ends_well() {
    let folder = scratch("handbook_logs");
    assert_eq!(follow_in("logs.md", &folder), 10);
}

#[test]
fn every_command_of_the_page_on_parameters_ends_well() {
    let folder = scratch("handbook_params");
    std::fs::create_dir(folder.join("examples")).unwrap();
    std::fs::copy(root().join("examples/machine.toml"), folder.join("examples/machine.toml")).unwrap();
    assert_eq!(follow_in("configure-a-drive.md", &folder), 12);
}

#[test]
fn every_command_of_the_page_on_lss_ends_well() {
    assert_eq!(follow("lss.md"), 7);
}

#[test]
fn every_command_of_the_other_pages_ends_well() {
    assert_eq!(follow("two-axes-from-a-test.md"), 0);
    assert_eq!(follow("add-an-object.md"), 0);
    assert_eq!(follow("add-a-drive.md"), 2);
    assert_eq!(follow("adapters.md"), 3);
    assert_eq!(follow("ros2-canopen.md"), 3);
    assert_eq!(follow("write-a-scenario.md"), 2);
    assert_eq!(follow("plan-a-bus.md"), 1);
    assert_eq!(follow("why-it-does-not-move.md"), 3);
    assert_eq!(follow("start-up.md"), 2);
    assert_eq!(follow("several-axes.md"), 4);
}
