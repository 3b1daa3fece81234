//! `ferrodrive studio` as a process: its first line, who is let in, how it ends.

mod common;
#[path = "common/studio.rs"]
mod studio;

use common::ferrodrive;
use studio::Studio;

#[test]
fn the_first_line_is_the_way_in_and_the_embedded_drives_are_there() {
    let studio = Studio::start(&[]);
    assert!(studio.ask("GET /", "").starts_with("HTTP/1.1 401"));
    let opened = studio.ask(&format!("GET /?token={}", studio.token), "");
    assert!(opened.starts_with("HTTP/1.1 303") && opened.contains("HttpOnly"), "{opened}");
    let state = studio.scanned();
    let nodes: Vec<_> = state["nodes"].as_array().unwrap().iter().map(|node| node["node"].as_u64()).collect();
    assert_eq!(nodes, [Some(1), Some(2), Some(4)]);
    assert_eq!(state["nodes"][2]["model"], "zlac8030l");
    // All is as it is delivered, without power on the motor.
    assert_eq!(state["nodes"][2]["drive"]["state"], "Switch on disabled");
}

#[cfg(unix)]
#[test]
fn it_ends_when_it_is_asked_to() {
    let mut studio = Studio::start(&[]);
    studio.state();
    let asked = std::process::Command::new("kill").arg(studio.child.id().to_string()).status().unwrap();
    assert!(asked.success());
    assert_eq!(studio.child.wait().unwrap().code(), Some(143));
}

#[test]
fn elsewhere_takes_a_password_and_says_what_that_means() {
    let ended = ferrodrive(&["studio", "--listen", "0.0.0.0:0"]);
    assert_eq!(ended.status, Some(2), "{}", ended.err);
    assert!(ended.err.contains("--password-file") && ended.err.contains("can move the drives"), "{}", ended.err);
    let directory = common::scratch("studio");
    let short = directory.join("short");
    std::fs::write(&short, "hunter2\n").unwrap();
    let ended = ferrodrive(&["studio", "--listen", "0.0.0.0:0", "--password-file", short.to_str().unwrap()]);
    assert_eq!(ended.status, Some(2), "{}", ended.err);
    assert!(ended.err.contains("at least 12"), "{}", ended.err);
    let missing = ferrodrive(&["studio", "--password-file", "/no/such/file"]);
    assert_eq!(missing.status, Some(1), "{}", missing.err);
    std::fs::remove_dir_all(directory).unwrap();
}
