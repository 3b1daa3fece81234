//! `ferrodrive run --serve`: the end of a scenario whose host is a program outside. How it is gone through with such a host is asked in
//! virtual time (`crates/serve/tests/it/followed.rs`).

use std::path::{Path, PathBuf};

use processes::{Scratch, Simulator, scratch};

const SERVE: [&str; 2] = ["--serve", "socketcand://127.0.0.1:0"];

/// A scenario of a ZLAC8030L at node 4 in a directory of the test's own.
fn scenario(name: &str, rest: &str) -> (Scratch, PathBuf) {
    let folder = scratch(name);
    let file = folder.join("scenario.toml");
    std::fs::write(&file, format!("machine = {{ drive = [{{ model = 'zlac8030l', node = 4 }}] }}\n{rest}")).unwrap();
    (folder, file)
}

fn start(file: &Path, options: &[&str]) -> Simulator {
    Simulator::start_scenario(&[&[file.to_str().expect("UTF-8")], options].concat())
}

#[cfg(unix)]
#[test]
fn a_signal_ends_it_with_what_was_seen_until_then() {
    let (_folder, file) = scenario("served-signal", "limit = '60min'\n[[expect]]\nthat = '4 velocity > 5'\n");
    let mut served = start(&file, &SERVE);
    assert!(served.ready.starts_with("ready socketcand://127.0.0.1:"), "{}", served.ready);
    served.signal("-TERM");
    assert_eq!(served.wait(), Some(143));
    let text = served.lines_left().join("\n");
    assert!(text.contains("4 velocity > 5") && text.contains("0 of 1 as expected"), "{text}");
}
