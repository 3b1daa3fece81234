//! `ferrodrive params` over a served bus: a kill between two writes, and the way back.

use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::Duration;

use processes::{Ended, Scratch, Simulator, command, scratch, wait_until};

struct Served {
    /// It ends with this.
    _simulator: Simulator,
    bus: String,
    folder: Scratch,
}

impl Served {
    fn new(name: &str, options: &[&str]) -> Self {
        let simulator = Simulator::start(&[options, &["--serve", "socketcand://127.0.0.1:0"]].concat());
        let bus = simulator.bus("socketcand");
        let served = Self { _simulator: simulator, bus, folder: scratch(name) };
        wait_until("the drive boots", || served.run(&["read", served.node(), "1000"]).status == Some(0));
        served
    }

    fn node(&self) -> &'static str {
        "4"
    }

    fn command(&self, arguments: &[&str]) -> std::process::Command {
        let mut command = command(&[&["--bus", &self.bus, "--timeout", "10s"], arguments].concat());
        // Where journals are kept.
        command.current_dir(&self.folder).stdin(Stdio::null());
        command
    }

    fn run(&self, arguments: &[&str]) -> Ended {
        let output = self.command(arguments).output().expect("the binary runs");
        let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
        Ended { status: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
    }

    fn journal(&self) -> PathBuf {
        self.folder.join("ferrodrive-node4.journal")
    }
}

/// Far more writes than fit into the time until a look at the folder: at 10 kbit/s each takes 50 ms and more.
fn many_values(begin: i64) -> String {
    let ramps =
        (0x6081..=0x6085).filter(|index| *index != 0x6082).map(|index| format!("{index:X} = {}\n", begin + index));
    let windows =
        [0x6065, 0x6066, 0x6067, 0x6068, 0x606D, 0x606E, 0x606F, 0x6070].map(|index| format!("{index:X} = {begin}\n"));
    let communication = [0x1006, 0x1015, 0x1017, 0x100C].map(|index| format!("{index:X} = {begin}\n"));
    ramps.chain(windows).chain(communication).collect()
}

/// Waits for a journal that is whole, before whose last line nothing is written to the node, or for a command that was faster.
fn wait_for(path: &Path, child: &mut Child) {
    while !std::fs::read_to_string(path).is_ok_and(|text| text.contains("whole = true")) {
        if let Some(status) = child.try_wait().expect("a child") {
            assert!(status.success(), "it has ended: {status}");
            return;
        }
        // Looked at again and again.
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[cfg(unix)]
#[test]
fn after_a_kill_between_two_writes_the_journal_leads_back() {
    let served = Served::new("params_killed", &["--drive", "cia402@4", "--bitrate", "10k"]);
    let model = ["--model", "4=cia402"];
    let run = |arguments: &[&str]| served.run(&[&model[..], arguments].concat());
    let before = served.folder.values("before.toml", &many_values(50));
    let wanted = served.folder.values("wanted.toml", &many_values(60));
    let arguments = [&model[..], &["params", "apply", "4", &wanted]].concat();
    // On a busy machine it may be done before the kill: then once more.
    wait_until("it is killed while it writes", || {
        assert_eq!(run(&["params", "apply", "4", &before]).status, Some(0));
        let mut child =
            served.command(&arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it runs");
        wait_for(&served.journal(), &mut child);
        child.kill().expect("it was running, or has not been waited for");
        child.wait().expect("it has ended");
        served.journal().exists()
    });
    // The answer to its last request is still on its way, and would be one to the wrong question.
    wait_until("its last request is answered", || run(&["read", "4", "1000"]).status == Some(0));
    // No other one begins over it.
    let ended = run(&["params", "apply", "4", &wanted]);
    assert!(ended.status == Some(1) && ended.err.contains("params rollback 4"), "{}{}", ended.out, ended.err);
    let back = run(&["params", "rollback", "4"]);
    assert!(back.status == Some(0) && back.out.contains("read as before"), "{}{}", back.out, back.err);
    let verified = run(&["params", "verify", "4", &before]);
    assert_eq!(verified.status, Some(0), "{}{}", verified.out, verified.err);
    let again = run(&["params", "rollback", "4"]);
    assert!(again.status == Some(1) && again.err.contains("there is no journal"), "{}", again.err);
}
