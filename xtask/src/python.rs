//! The Python package: environments with pinned packages, the wheel, and the tests against the installed wheel.
//!
//! Environments stand under `target/` and stay for the next run. A machine without Python or without a network skips what
//! needs them and reports it; it never fails for that.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, OnceLock, PoisonError};

use crate::cross::Cross;
use crate::say::say;
use crate::tally::Tally;
use crate::{builder, process, program, workspace};

/// The pinned packages that the wheel is built and tested with.
pub(crate) const REQUIREMENTS: &str = "crates/python/tests/requirements.txt";

/// The environment that has them.
pub(crate) const VENV: &str = "python-venv";

/// What is needed for some of the tests alone, and is left out where it does not install.
const FURTHER_REQUIREMENTS: &str = "crates/python/tests/further_requirements.txt";

/// With it the package is built on what the tests of the command line have built already.
const SHARED_BUILD: &str = "ferrodrive-python/shared-build";

/// The tests, of the package and of what users copy from.
const TESTS: &[&str] = &["crates/python/tests", "examples/mobile_base_tests", "examples/arm_tests", "examples/mujoco"];

/// What the step takes of others.
pub(crate) fn fetch() -> Result<(), String> {
    environment(VENV, REQUIREMENTS).and_then(|python| install_further(&python))
}

fn install_further(python: &Path) -> Result<(), String> {
    process::output(pip(python).args(["install", "--quiet", "-r", FURTHER_REQUIREMENTS])).map(|_| ())
}

/// The python step of `cargo xtask test`.
pub(crate) fn step() -> Tally {
    let python = match environment(VENV, REQUIREMENTS) {
        Ok(python) => python,
        Err(reason) => return Tally::skipped(reason),
    };
    if let Err(error) = install_wheel(&python).and_then(|()| lint(&python)) {
        return Tally::failed(error);
    }
    if let Err(error) = install_further(&python) {
        let reason = error.lines().last().unwrap_or_default();
        say(format_args!("without what {FURTHER_REQUIREMENTS} names, which does not install here: {reason}"));
    }
    run_tests(&python)
}

/// Installs the package into an environment, as the profile of the tests builds it.
pub(crate) fn install_wheel(python: &Path) -> Result<(), String> {
    let wheel = wheel_of_tests()?;
    let mut pip = pip(python);
    process::output(pip.args(["install", "--quiet", "--no-deps", "--force-reinstall"]).arg(wheel)).map(|_| ())
}

/// The wheel with the binary of the tests, built once in a run of the chores: three steps use it.
pub(crate) fn wheel_of_tests() -> Result<PathBuf, String> {
    static BUILT: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    let build = || {
        let python = environment(VENV, REQUIREMENTS)?;
        wheel(&python, "dev", Some(&program::built()?), None, &workspace::target().join("wheel"))
    };
    BUILT.get_or_init(build).clone()
}

/// Builds the wheel in a cargo profile, around a binary that is there already or with one of its own, into an emptied folder;
/// returns its path.
pub(crate) fn wheel(
    python: &Path,
    profile: &str,
    program: Option<&Path>,
    cross: Option<&Cross>,
    folder: &Path,
) -> Result<PathBuf, String> {
    for old in wheels_in(folder) {
        std::fs::remove_file(&old).map_err(|error| format!("{}: {error}", old.display()))?;
    }
    say(format_args!("building the wheel ({profile})"));
    let mut pip = pip(python);
    // The environment has the build's needs, in pinned versions.
    pip.args(["wheel", "--quiet", "--no-deps", "--no-build-isolation", "--wheel-dir"]).arg(folder).arg(".");
    match cross {
        Some(cross) => {
            let target = cross.target();
            pip.arg(format!("--config-settings=build-args=--profile {profile} --locked --target {target}"));
            cross.set_tools(&mut pip);
        }
        None if profile == "dev" => {
            pip.arg(format!("--config-settings=build-args=--profile dev --locked --features {SHARED_BUILD}"));
        }
        None => {}
    }
    if profile != "dev" {
        builder::leave_out(&mut pip);
    }
    pip.env("FERRODRIVE_PROFILE", profile).env("CARGO_TARGET_DIR", workspace::target());
    pip.envs(program.map(|program| ("FERRODRIVE_PROGRAM", program)));
    process::output(pip.env("PATH", with_tools_of(python)?))?;
    wheels_in(folder).pop().ok_or_else(|| format!("pip left no wheel in {}", folder.display()))
}

/// `PATH` for a tool that looks for others beside the interpreter.
pub(crate) fn with_tools_of(python: &Path) -> Result<OsString, String> {
    let tools = python.parent().map(Path::to_path_buf).into_iter();
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::join_paths(tools.chain(std::env::split_paths(&path))).map_err(|error| error.to_string())
}

/// The Python of an environment `target/NAME` that has the packages of a requirements file, made now if need be; or why
/// there is none.
pub(crate) fn environment(name: &str, requirements: &str) -> Result<PathBuf, String> {
    let file = workspace::root().join(requirements);
    environment_of(name, &std::fs::read_to_string(file).map_err(|error| format!("{requirements}: {error}"))?)
}

/// The same, with the packages named here: a line each.
pub(crate) fn environment_of(name: &str, wanted: &str) -> Result<PathBuf, String> {
    // A second step finds what the first has made.
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = workspace::target().join(name);
    let python = folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    let stamp = folder.join("installed.txt");
    if std::fs::read_to_string(&stamp).is_ok_and(|installed| installed == wanted) && python.exists() {
        return Ok(python);
    }
    let system = ["python3", "python"].into_iter().find(|name| process::works(name, &["-c", "import venv, ensurepip"]));
    let system = system.ok_or("no Python 3 with venv on this machine")?;
    say(format_args!("making a Python environment in {}", folder.display()));
    process::output(Command::new(system).args(["-m", "venv", "--clear"]).arg(&folder))?;
    let packages: Vec<&str> = wanted.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    process::output(pip(&python).args(["install", "--quiet"]).args(&packages)).map_err(|error| {
        let reason = error.lines().last().unwrap_or_default().to_owned();
        format!("pip could not install {} (no network?): {reason}", packages.join(" "))
    })?;
    std::fs::write(&stamp, wanted).map_err(|error| error.to_string())?;
    Ok(python)
}

/// `python -m pip`, which gives up soon without a network.
pub(crate) fn pip(python: &Path) -> Command {
    let mut pip = Command::new(python);
    pip.current_dir(workspace::root()).args(["-m", "pip", "--disable-pip-version-check", "--retries", "1"]);
    pip.args(["--timeout", "20"]);
    pip
}

/// What the steps of the other crates do, which need no interpreter, for this one.
fn lint(python: &Path) -> Result<(), String> {
    if process::works("cargo", &["clippy", "--version"]) {
        let mut clippy = workspace::cargo();
        clippy.args(["clippy", "--package", "ferrodrive-python", "--features", SHARED_BUILD, "--quiet"]);
        clippy.args(["--", "-D", "warnings"]);
        process::output(clippy.env("PYO3_PYTHON", python))?;
    }
    let mut mypy = Command::new(python);
    mypy.current_dir(workspace::root().join("crates/python")).args(["-m", "mypy", "--no-error-summary", "--strict"]);
    mypy.arg("--cache-dir").arg(workspace::target().join("mypy")).arg("python/ferrodrive");
    process::output(&mut mypy).map(|_| ())
}

fn run_tests(python: &Path) -> Tally {
    let mut pytest = Command::new(python);
    // From elsewhere, so that the installed package is tested and not the sources.
    pytest.current_dir(workspace::target()).args([
        "-m",
        "pytest",
        "-p",
        "no:cacheprovider",
        "--tb=short",
        "-rfEs",
        "-v",
    ]);
    pytest.args(TESTS.iter().map(|folder| workspace::root().join(folder)));
    let (mut tally, mut lines) = (Tally::default(), Vec::new());
    let ended_well = process::run(&mut pytest, |line| {
        say(line);
        count(line, &mut tally);
        lines.push(line.to_owned());
    });
    match ended_well {
        Ok(true) if tally == Tally::default() => Tally::failed("pytest ran nothing"),
        Ok(true) => tally,
        Ok(false) => {
            tally.failed = tally.failed.max(1);
            (tally.note, tally.output) = failures(&lines);
            tally
        }
        Err(error) => Tally::failed(error),
    }
}

/// The names of the tests that failed, and what `pytest` says of them: what stands between the heading of the first and the list of those
/// that were skipped or failed.
fn failures(lines: &[String]) -> (String, Vec<String>) {
    let is_heading =
        |line: &str, names: &[&str]| line.starts_with("===") && names.iter().any(|name| line.contains(name));
    let from_first = lines.iter().skip_while(|line| !is_heading(line, &[" FAILURES ", " ERRORS "]));
    let output: Vec<String> =
        from_first.take_while(|line| !is_heading(line, &["short test summary"])).cloned().collect();
    let named = |line: &String| {
        let rest = line.strip_prefix("FAILED ").or_else(|| line.strip_prefix("ERROR "))?;
        Some(rest.split(" - ").next()?.rsplit('/').next()?.to_owned())
    };
    let names: Vec<String> = lines.iter().filter_map(named).collect();
    (if names.is_empty() { "pytest ended badly: read the lines above".to_owned() } else { names.join(", ") }, output)
}

/// Counts one line of `pytest -v`: `FILE::TEST PASSED [ 5%]`.
fn count(line: &str, tally: &mut Tally) {
    let Some((_, after)) = line.split_once("::") else { return };
    // The name of a test may hold blanks.
    let is = |outcome: &str| after.contains(outcome);
    if is(" PASSED") {
        tally.passed += 1;
    } else if is(" FAILED") || is(" ERROR") {
        tally.failed += 1;
    } else if is(" SKIPPED") {
        tally.skipped += 1;
    }
}

pub(crate) fn wheels_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    entries.filter(|path| path.extension().is_some_and(|ending| ending == "whl")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_pytest_are_counted_by_their_outcome() {
        let mut tally = Tally::default();
        let lines = [
            "tests/test_a.py::test_one PASSED                  [  5%]",
            "tests/test_a.py::test_two[4-x y] FAILED           [ 10%]",
            "tests/test_a.py::test_three SKIPPED (no fork)     [ 15%]",
            "FAILED tests/test_a.py::test_two[4-x y] - assert 1 == 2",
        ];
        lines.iter().for_each(|line| count(line, &mut tally));
        assert_eq!((tally.passed, tally.failed, tally.skipped), (1, 1, 1));
    }

    #[test]
    fn a_failed_test_is_named_with_what_it_said() {
        let lines = [
            "tests/test_a.py::test_two[4-x y] FAILED           [ 10%]",
            "=================== FAILURES ===================",
            "_________________ test_two _________________",
            "E   assert 1 == 2",
            "=========== short test summary info ============",
            "SKIPPED [1] tests/test_b.py:3: no fork",
            "FAILED ../crates/python/tests/test_a.py::test_two[4-x y] - assert 1 == 2",
        ];
        let (names, output) = failures(&lines.map(str::to_owned));
        assert_eq!(names, "test_a.py::test_two[4-x y]");
        assert_eq!(output, lines[1..4]);
        assert_eq!(failures(&[]).0, "pytest ended badly: read the lines above");
    }
}
