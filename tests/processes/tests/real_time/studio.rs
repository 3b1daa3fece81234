//! `ferrodrive studio` as a process: its first line and its end.

use processes::studio::Studio;

#[cfg(unix)]
#[test]
fn the_first_line_is_the_way_in_the_embedded_drives_are_there_and_it_ends_when_it_is_asked_to() {
    let mut studio = Studio::start(&[]);
    assert!(studio.ask("GET /", "").starts_with("HTTP/1.1 401"));
    let opened = studio.ask(&format!("GET /?token={}", studio.token), "");
    assert!(opened.starts_with("HTTP/1.1 303") && opened.contains("HttpOnly"), "{opened}");
    let state = studio.scanned();
    let nodes: Vec<_> = state["nodes"].as_array().unwrap().iter().map(|node| node["node"].as_u64()).collect();
    assert_eq!(nodes, [Some(1), Some(2), Some(4)]);
    assert_eq!(state["nodes"][2]["model"], "zlac8030l");
    // All is as it is delivered, without power on the motor.
    assert_eq!(state["nodes"][2]["drive"]["state"], "Switch on disabled");
    let asked = std::process::Command::new("kill").arg(studio.child.id().to_string()).status().unwrap();
    assert!(asked.success());
    assert_eq!(studio.child.wait().unwrap().code(), Some(143));
}

/// Starts a studio that opens its page with the programs of `path`, and gives what it prints and says once `wanted` holds of
/// either.
#[cfg(target_os = "linux")]
fn opened_with(path: &std::path::Path, what: &str, wanted: impl Fn() -> bool) -> (String, String) {
    let (out, err) = (path.join("out"), path.join("err"));
    let mut child = processes::command(&["studio", "--listen", "127.0.0.1:0", "--open"])
        .env("PATH", path)
        .stdout(std::fs::File::create(&out).unwrap())
        .stderr(std::fs::File::create(&err).unwrap())
        .spawn()
        .unwrap();
    processes::wait_until(what, wanted);
    // It serves on, whether a browser was found or not.
    let ended = child.try_wait().unwrap();
    child.kill().unwrap();
    child.wait().unwrap();
    let texts = (std::fs::read_to_string(out).unwrap(), std::fs::read_to_string(err).unwrap());
    assert!(ended.is_none(), "{what}: {ended:?} {texts:?}");
    texts
}

#[cfg(target_os = "linux")]
#[test]
fn the_page_is_opened_by_the_desktop_and_without_one_that_is_said() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let directory = processes::scratch("studio_open");
    let err = directory.join("err");
    let is_said =
        |part: &str| std::fs::read_to_string(&err).is_ok_and(|text| text.contains(part) && text.ends_with('\n'));

    opened_with(&directory, "no xdg-open", || is_said("cannot open a browser (xdg-open: No such file"));

    // As xdg-open without a browser: it fails.
    let program = directory.join("xdg-open");
    symlink("/bin/false", &program).unwrap();
    opened_with(&directory, "a failing xdg-open", || is_said("(xdg-open: exit status: 1): open the address yourself"));
    std::fs::remove_file(&program).unwrap();

    std::fs::write(&program, "#!/bin/sh\nprintf '%s\\n' \"$#\" \"$1\" > \"$0.asked\"\n").unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    let asked = || std::fs::read_to_string(directory.join("xdg-open.asked")).unwrap_or_default();
    let (out, said) = opened_with(&directory, "the address", || asked().lines().count() == 2);
    let address = out.lines().next().and_then(|line| line.strip_prefix("studio ")).unwrap();
    assert_eq!(asked(), format!("1\n{address}\n"));
    assert!(!said.contains("cannot open"), "{said}");
}
