//! Other people's software against ours: canopen-python, python-can and pymodbus talk to `ferrodrive sim`.
//!
//! The Python packages go into a private environment under `target/`, in pinned versions, and stay there for the next
//! run. A machine without Python or without a network skips this step and says so; it never fails for that.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::tally::Tally;
use crate::{process, program, workspace};

/// The pinned packages: one file that people can also give to `pip install -r`.
const REQUIREMENTS: &str = "tests/peers/requirements.txt";
const SCRIPT: &str = "tests/peers/run.py";

pub(crate) fn run() -> Tally {
    let program = match program::build("sim") {
        Ok(program) => program,
        Err(tally) => return tally,
    };
    let python = match environment() {
        Ok(python) => python,
        Err(reason) => return Tally::skipped(reason),
    };
    let root = workspace::root();
    let mut command = Command::new(&python);
    command.current_dir(&root).arg("-u").arg(root.join(SCRIPT)).arg("--program").arg(program);
    let mut tally = Tally::default();
    let ended_well = process::run(&mut command, |line| {
        println!("   {line}");
        count(line, &mut tally);
    });
    match ended_well {
        Ok(true) if tally == Tally::default() => Tally::failed("the peers checked nothing"),
        Ok(true) => tally,
        Ok(false) => {
            tally.failed = tally.failed.max(1);
            tally.note = "a peer disagrees: read the lines above".to_owned();
            tally
        }
        Err(error) => Tally::failed(error),
    }
}

/// The Python of an environment that has the pinned packages, made now if need be; or why there is none.
fn environment() -> Result<PathBuf, String> {
    let folder = workspace::target().join("peers-venv");
    let wanted = std::fs::read_to_string(workspace::root().join(REQUIREMENTS)).map_err(|error| error.to_string())?;
    let python = folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    let stamp = folder.join("installed.txt");
    if std::fs::read_to_string(&stamp).is_ok_and(|installed| installed == wanted) && python.exists() {
        return Ok(python);
    }
    let system = ["python3", "python"].into_iter().find(|name| process::works(name, &["-c", "import venv, ensurepip"]));
    let system = system.ok_or("no Python 3 with venv on this machine")?;
    println!("   making a Python environment in {}", folder.display());
    process::output(Command::new(system).args(["-m", "venv", "--clear"]).arg(&folder))?;
    install(&python)?;
    std::fs::write(&stamp, wanted).map_err(|error| error.to_string())?;
    Ok(python)
}

fn install(python: &Path) -> Result<(), String> {
    let mut pip = Command::new(python);
    pip.current_dir(workspace::root());
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--retries", "1", "--timeout", "20"]);
    pip.args(["-r", REQUIREMENTS]);
    process::output(&mut pip).map(|_| ()).map_err(|error| {
        let reason = error.lines().last().unwrap_or_default().to_owned();
        format!("pip could not install the peers (no network?): {reason}")
    })
}

/// Counts one line of the script: `ok NAME`, `FAILED NAME: why`, `skipped NAME: why`.
fn count(line: &str, tally: &mut Tally) {
    match line.split_once(' ').map(|(word, _)| word) {
        Some("ok") => tally.passed += 1,
        Some("FAILED") => tally.failed += 1,
        Some("skipped") => tally.skipped += 1,
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_the_script_are_counted_by_their_first_word() {
        let mut tally = Tally::default();
        let lines = ["ok boots up", "FAILED reads 1000h: timeout", "skipped torque: no motor", "a remark"];
        lines.iter().for_each(|line| count(line, &mut tally));
        assert_eq!((tally.passed, tally.failed, tally.skipped), (1, 1, 1));
    }
}
