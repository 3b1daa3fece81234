//! `cargo xtask dist`: what is released, in one folder: an archive of the stripped binary with manual pages, completions, the data
//! sheets of the models and the licences of everything that is in it; the Python wheel; the checksums of both.
//!
//! The binary is the one of `cargo xtask pgo` where its tools can be had, and the same is in the wheel. The test makes all of it
//! in the profile of the tests, unpacks the archive in an empty folder, and uses binary and wheel from there.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::cross::Cross;
use crate::say::say;
use crate::tally::Tally;
use crate::{builder, pgo, process, program, python, wheel, workspace};

const SHELLS: &[(&str, &str)] = &[("bash", "ferrodrive.bash"), ("zsh", "_ferrodrive"), ("fish", "ferrodrive.fish")];

/// What a file with a licence is called, however its packages spell it.
const LICENCE_NAMES: &[&str] = &["LICENSE", "LICENCE", "COPYING", "COPYRIGHT", "NOTICE", "UNLICENSE"];

const CHECKSUMS: &str = "SHA256SUMS";

/// Runs `cargo xtask dist [ARCHITECTURE]`.
pub(crate) fn command(architecture: Option<&str>) -> ExitCode {
    let folder = workspace::root().join("dist");
    let made = match architecture {
        Some(name) => Cross::found(name).and_then(|cross| {
            let binaries =
                Binaries { program: cross.program("dist")?, speaker: program::built()?, cross: Some(&cross) };
            make(&binaries, "dist", &folder)
        }),
        None => release_binary().and_then(|(program, how)| {
            println!("{how}");
            make(&Binaries::own(program), "dist", &folder)
        }),
    };
    match made {
        Ok(notes) => {
            notes.iter().for_each(|note| println!("{note}"));
            println!("{}", folder.display());
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("nothing to release: {error}");
            ExitCode::FAILURE
        }
    }
}

/// The dist step of `cargo xtask test`: the release as the tests' profile makes it, used on a machine without anything else.
pub(crate) fn step() -> Tally {
    let folder = workspace::target().join("dist-test");
    let made = program::built().and_then(|program| make(&Binaries::own(program), "dev", &folder.join("dist")));
    tried(made, || try_it(&folder, None))
}

/// The aarch64 step: the same for another architecture, whose programs are run by an emulator.
pub(crate) fn cross_step() -> Tally {
    let cross = match Cross::found("aarch64") {
        Ok(cross) => cross,
        Err(reason) => return Tally::skipped(reason),
    };
    let folder = workspace::target().join("dist-test-aarch64");
    let built = cross
        .program("dev")
        .and_then(|program| Ok(Binaries { program, speaker: program::built()?, cross: Some(&cross) }));
    let made = built.and_then(|binaries| make(&binaries, "dev", &folder.join("dist")));
    tried(made, || try_it(&folder, Some(&cross)))
}

/// What a release that was made, with these notes, is worth.
fn tried(made: Result<Vec<String>, String>, tries: impl FnOnce() -> Vec<(&'static str, Result<(), String>)>) -> Tally {
    let notes = match made {
        Ok(notes) => notes,
        Err(error) => return Tally::failed(error),
    };
    let mut tally = Tally::default();
    for (what, outcome) in tries() {
        say(format_args!("{what}: {}", outcome.as_ref().map_or_else(|error| error.as_str(), |()| "ok")));
        tally.add(&outcome.map_or_else(|error| Tally::failed(format!("{what}: {error}")), |()| Tally::passed()));
    }
    notes.into_iter().for_each(|note| tally.add(&Tally::skipped(note)));
    tally
}

/// The binary that is released, and how it was built: optimised by a training run where the tools for that can be had.
fn release_binary() -> Result<(PathBuf, String), String> {
    match pgo::Tools::find() {
        Ok(tools) => Ok((pgo::build(&tools)?, "the binary is optimised by its training run (cargo xtask pgo)".into())),
        Err(reason) => Ok((program::of_dist()?, format!("the binary is not optimised by a training run: {reason}"))),
    }
}

/// What a release is made of.
struct Binaries<'a> {
    /// The binary that is released.
    program: PathBuf,
    /// One that this machine runs: it prints manual pages, completions and data sheets.
    speaker: PathBuf,
    /// The tools of another architecture.
    cross: Option<&'a Cross>,
}

impl Binaries<'_> {
    /// For machines like this one.
    fn own(program: PathBuf) -> Self {
        Self { speaker: program.clone(), program, cross: None }
    }
}

/// The name of the archive without its ending, and of the folder in it: `ferrodrive-0.1.0-x86_64-linux`.
fn archive_name(cross: Option<&Cross>) -> String {
    let (version, system) = (env!("CARGO_PKG_VERSION"), std::env::consts::OS);
    let architecture = cross.map_or(std::env::consts::ARCH, |cross| cross.architecture.name);
    format!("ferrodrive-{version}-{architecture}-{system}")
}

/// Makes the folder anew; returns what could not be in it, and why.
fn make(binaries: &Binaries<'_>, profile: &str, release: &Path) -> Result<Vec<String>, String> {
    let Binaries { program, speaker, cross } = binaries;
    let _ = fs::remove_dir_all(release);
    let mut notes = Vec::new();
    let folder = &release.join(archive_name(*cross));
    let binary = folder.join("bin").join(program.file_name().unwrap_or_default());
    copy(program, &binary)?;
    // The names of functions are most of a binary; what a panic says needs none.
    let name = binary.to_string_lossy();
    if !cross.map_or_else(|| process::works("strip", &[&name]), |cross| cross.strip(&name)) {
        notes.push("the binary is not stripped: there is no `strip` here".to_owned());
    }
    if profile != "dev"
        && let Some(path) = builder::named_in(&binary)?
    {
        return Err(format!("{} names a folder of this machine: {path}", binary.display()));
    }
    let run = |words: &[&str]| process::output(Command::new(speaker).args(words));
    run(&["man-pages", &folder.join("man/man1").to_string_lossy()])?;
    for (shell, name) in SHELLS {
        write(&folder.join("completions").join(name), &run(&["completions", shell])?)?;
    }
    for model in models(speaker)? {
        write(&folder.join("eds").join(format!("{model}.eds")), &run(&["eds", &model])?)?;
    }
    for name in ["README.md", "CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT"] {
        copy(&workspace::root().join(name), &folder.join(name))?;
    }
    let mut packages = foreign_packages("Cargo.toml", "ferrodrive")?;
    match python::environment(python::VENV, python::REQUIREMENTS) {
        Ok(python) => {
            let wheel = add_wheel(&python, profile, (&binary, *cross), release)?;
            packages.extend(foreign_packages("crates/python/Cargo.toml", "ferrodrive-python")?);
            notes.extend(
                wheel::tag(&wheel).err().map(|reason| format!("the wheel is for machines like this one: {reason}")),
            );
        }
        Err(reason) => notes.push(format!("no wheel: {reason}")),
    }
    licences(packages, &folder.join("licences"))?;
    pack(release, &archive_name(*cross))?;
    write(&release.join(CHECKSUMS), &checksums(release)?)?;
    Ok(notes)
}

/// The folder of the archive becomes the archive.
fn pack(release: &Path, name: &str) -> Result<(), String> {
    let archive = format!("{name}.tar.gz");
    process::output(Command::new("tar").current_dir(release).args(["-czf", &archive, name]))?;
    fs::remove_dir_all(release.join(name)).map_err(|error| format!("{name}: {error}"))
}

/// The wheel around this binary, in `folder`.
fn add_wheel(
    python: &Path,
    profile: &str,
    (binary, cross): (&Path, Option<&Cross>),
    folder: &Path,
) -> Result<PathBuf, String> {
    if profile != "dev" || cross.is_some() {
        fs::create_dir_all(folder).map_err(|error| error.to_string())?;
        return python::wheel(python, profile, Some(binary), cross, folder);
    }
    // The tests' own is the same wheel.
    let wheel = python::wheel_of_tests()?;
    let copied = folder.join(wheel.file_name().unwrap_or_default());
    copy(&wheel, &copied).map(|()| copied)
}

/// The models that the program knows, as its own refusal lists them.
fn models(program: &Path) -> Result<Vec<String>, String> {
    let refusal = Command::new(program).args(["eds", "?"]).output().map_err(|error| error.to_string())?;
    let text = String::from_utf8_lossy(&refusal.stderr).into_owned();
    let list = text.split("expected one of: ").nth(1).and_then(|rest| rest.split(", or a file").next());
    let names = list.ok_or_else(|| format!("no list of models in: {text}"))?;
    Ok(names.split(',').map(|name| name.trim().to_owned()).collect())
}

/// The licence files of these packages, and a list of them all.
fn licences(packages: Packages, folder: &Path) -> Result<(), String> {
    let mut list = String::new();
    for (name, (licence, source)) in packages {
        list.push_str(&format!("{name}: {licence}\n"));
        let files = fs::read_dir(&source).map_err(|error| format!("{}: {error}", source.display()))?;
        for file in files.flatten().map(|file| file.path()).filter(|path| is_licence(path)) {
            copy(&file, &folder.join(&name).join(file.file_name().unwrap_or_default()))?;
        }
    }
    write(&folder.join("LICENCES.txt"), &list)
}

fn is_licence(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_uppercase();
    path.is_file() && LICENCE_NAMES.iter().any(|known| name.starts_with(known))
}

/// Packages by name and version: licence, and where the source is.
type Packages = BTreeMap<String, (String, PathBuf)>;

/// What a package of the project is made of beside the project's own.
fn foreign_packages(manifest: &str, package: &str) -> Result<Packages, String> {
    let mut tree = workspace::cargo();
    tree.args(["tree", "--manifest-path", manifest, "--package", package, "--edges", "normal"]);
    tree.args(["--prefix", "none", "--format", "{p}"]);
    let tree = process::output(&mut tree)?;
    let used = |name: &str, version: &str| {
        let wanted = format!("{name} v{version}");
        tree.lines().any(|line| line == wanted || line.starts_with(&format!("{wanted} ")))
    };
    let text =
        process::output(workspace::cargo().args(["metadata", "--manifest-path", manifest, "--format-version", "1"]))?;
    let metadata: Value = serde_json::from_str(&text).map_err(|error| format!("cargo metadata: {error}"))?;
    let packages = metadata["packages"].as_array().into_iter().flatten();
    let word = |package: &Value, key: &str| package[key].as_str().unwrap_or_default().to_owned();
    let foreign = packages.filter(|package| package["source"].is_string()).filter_map(|package| {
        let (name, version) = (word(package, "name"), word(package, "version"));
        let source = PathBuf::from(word(package, "manifest_path")).parent()?.to_path_buf();
        used(&name, &version).then(|| (format!("{name}-{version}"), (word(package, "license"), source)))
    });
    Ok(foreign.collect())
}

/// One line for each file, as `sha256sum --check` takes them.
fn checksums(folder: &Path) -> Result<String, String> {
    let mut lines = String::new();
    for path in files_in(folder) {
        let bytes = fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        let sum: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        let name = path.strip_prefix(folder).unwrap_or(&path).to_string_lossy().replace('\\', "/");
        lines.push_str(&format!("{sum}  {name}\n"));
    }
    Ok(lines)
}

/// Every file below a folder but the checksums, in order.
fn files_in(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for path in fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()) {
        if path.is_dir() {
            found.extend(files_in(&path));
        } else if path.file_name().is_some_and(|name| name != CHECKSUMS) {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// The steps of a user of a release: check the sums, run the program on its own, and install the wheel.
fn try_it(folder: &Path, cross: Option<&Cross>) -> Vec<(&'static str, Result<(), String>)> {
    let (dist, empty) = (folder.join("dist"), folder.join("empty"));
    let _ = fs::remove_dir_all(&empty);
    if let Err(error) = fs::create_dir_all(&empty) {
        return vec![("an empty folder", Err(error.to_string()))];
    }
    let mut tried = vec![
        ("every file is listed, with its sum", sums_agree(&dist)),
        ("the archive is unpacked in an empty folder", unpack(&dist, &empty, &archive_name(cross))),
    ];
    let unpacked = empty.join(archive_name(cross));
    tried.push(("its program reads a virtual drive", program_works(&unpacked, &empty, cross)));
    tried.push(("manual pages, completions, data sheets and licences have words", parts_have_words(&unpacked)));
    match (wheel_in(&dist), cross) {
        (Some(wheel), None) => {
            tried.push(("the wheel works in a new environment", wheel_works(&wheel, &unpacked, &empty)));
            if wheel::can_tag() {
                let tagged = is_for_all(&wheel, std::env::consts::ARCH);
                tried.push(("the wheel is one for all its machines", tagged));
            }
        }
        (Some(wheel), Some(cross)) => {
            tried.push(("the wheel is one for all its machines", is_for_all(&wheel, cross.architecture.name)));
        }
        (None, _) => {}
    }
    tried
}

fn unpack(dist: &Path, empty: &Path, name: &str) -> Result<(), String> {
    let archive = dist.join(format!("{name}.tar.gz"));
    process::output(Command::new("tar").current_dir(empty).arg("-xzf").arg(archive)).map(|_| ())
}

fn wheel_in(dist: &Path) -> Option<PathBuf> {
    files_in(dist).into_iter().find(|path| path.extension().is_some_and(|extension| extension == "whl"))
}

fn sums_agree(dist: &Path) -> Result<(), String> {
    let listed = fs::read_to_string(dist.join(CHECKSUMS)).map_err(|error| error.to_string())?;
    if checksums(dist)? == listed { Ok(()) } else { Err("the sums are not those of the files".into()) }
}

fn program_works(unpacked: &Path, empty: &Path, cross: Option<&Cross>) -> Result<(), String> {
    let program = unpacked.join("bin").join(format!("ferrodrive{}", std::env::consts::EXE_SUFFIX));
    let mut program = match cross {
        Some(cross) => cross.run(&program),
        None => {
            let mut program = Command::new(program);
            program.env_clear();
            program
        }
    };
    let answer = process::output(program.current_dir(empty).args(["--json", "read", "4", "6041h"]))?;
    if answer.contains("6041") { Ok(()) } else { Err(format!("it answered {answer}")) }
}

/// Its tag, which auditwheel gives by the files in it, names the architecture, any Linux and any Python.
fn is_for_all(wheel: &Path, architecture: &str) -> Result<(), String> {
    let name = wheel.file_name().unwrap_or_default().to_string_lossy();
    let is_tagged = name.contains("-abi3-manylinux") && name.ends_with(&format!("_{architecture}.whl"));
    if is_tagged { Ok(()) } else { Err(format!("it is called {name}")) }
}

fn parts_have_words(unpacked: &Path) -> Result<(), String> {
    for (path, words) in [
        ("man/man1/ferrodrive.1", ".TH"),
        ("man/man1/ferrodrive-sim.1", "\\-\\-drive"),
        ("completions/ferrodrive.bash", "complete"),
        ("completions/_ferrodrive", "#compdef"),
        ("eds/zlac8030l.eds", "[FileInfo]"),
        ("licences/LICENCES.txt", "clap-"),
    ] {
        let text = fs::read_to_string(unpacked.join(path)).map_err(|error| format!("{path}: {error}"))?;
        if !text.contains(words) {
            return Err(format!("{path} has no {words:?}"));
        }
    }
    Ok(())
}

fn wheel_works(wheel: &Path, unpacked: &Path, empty: &Path) -> Result<(), String> {
    // It is made of more than the program is.
    let licences = fs::read_to_string(unpacked.join("licences/LICENCES.txt")).map_err(|error| error.to_string())?;
    if !licences.contains("pyo3-") {
        return Err("the licences do not name what is in the wheel alone".into());
    }
    let system = python::environment(python::VENV, python::REQUIREMENTS)?;
    let folder = empty.join("venv");
    process::output(Command::new(system).args(["-m", "venv"]).arg(&folder))?;
    let tools = folder.join(if cfg!(windows) { "Scripts" } else { "bin" });
    let python = tools.join("python");
    process::output(python::pip(&python).args(["install", "--quiet", "--no-index"]).arg(wheel))?;
    let script =
        "import ferrodrive; w = ferrodrive.World(); d = w.add('zlac8030l', node=4); w.run_for(1); assert d.powered";
    process::output(Command::new(&python).current_dir(empty).args(["-c", script]))?;
    process::output(Command::new(tools.join("ferrodrive")).current_dir(empty).arg("--version")).map(|_| ())
}

pub(crate) fn copy(from: &Path, to: &Path) -> Result<(), String> {
    make_parent(to)?;
    fs::copy(from, to).map(|_| ()).map_err(|error| format!("{} to {}: {error}", from.display(), to.display()))
}

pub(crate) fn write(path: &Path, text: &str) -> Result<(), String> {
    make_parent(path)?;
    fs::write(path, text).map_err(|error| format!("{}: {error}", path.display()))
}

fn make_parent(path: &Path) -> Result<(), String> {
    let parent = path.parent().unwrap_or(path);
    fs::create_dir_all(parent).map_err(|error| format!("{}: {error}", parent.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn licence_files_are_known_by_their_names() {
        let root = workspace::root();
        assert!(is_licence(&root.join("LICENSE-MIT")) && is_licence(&root.join("LICENSE-APACHE")));
        assert!(!is_licence(&root.join("README.md")) && !is_licence(&root.join("LICENSE-NONE")));
    }
}
