//! A Rust for another target: the toolchain's own where rustup has installed the target, else one whose standard library is built
//! from the sources of the same version, which Debian has as a package. That takes half a minute once, and is kept under `target/`.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};

use crate::builder;
use crate::debian::{apt, last_line};
use crate::process::{self, output, quietly};
use crate::say::say;
use crate::workspace;

/// The suites of Debian that have had more than one version of Rust.
const SUITES: [&str; 5] = ["bookworm-backports", "trixie-backports", "trixie", "testing", "unstable"];

/// A target, and what of the standard library runs on it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Target {
    pub(crate) name: &'static str,
    /// As `-Zbuild-std` takes them.
    pub(crate) crates: &'static str,
    /// As `-Zbuild-std-features` takes them.
    pub(crate) features: &'static str,
    pub(crate) opt_level: &'static str,
    /// `abort` or `unwind`.
    pub(crate) panic: &'static str,
}

/// A Rust that builds for a target.
pub(crate) struct Rust {
    target: Target,
    /// Where its standard library is, if not in the toolchain itself.
    sysroot: Option<PathBuf>,
    /// The folder of the toolchain's own programs, with the linker.
    pub(crate) programs: PathBuf,
    /// What is built with it: its flags are not those of the other steps.
    built: PathBuf,
}

impl Rust {
    /// One that builds in `folder`.
    pub(crate) fn found(target: Target, folder: &Path) -> Result<Self, String> {
        let sysroot = PathBuf::from(rustc(&["--print", "sysroot"])?.trim());
        let host = host()?;
        let programs = sysroot.join("lib/rustlib").join(&host).join("bin");
        let built = folder.join("build");
        if Path::new(rustc(&["--print", "target-libdir", "--target", target.name])?.trim()).is_dir() {
            return Ok(Self { target, sysroot: None, programs, built });
        }
        // A second step finds what the first has made.
        static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
        let _alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
        let made = Made::of(target, &sysroot, &host, &version()?);
        if !made.sysroot.is_dir() {
            made.make().map_err(|error| {
                let name = target.name;
                format!("the target {name} is not installed, and cannot be made: {error}; or: rustup target add {name}")
            })?;
            // Cargo does not see that what it built was for another standard library.
            let _ = std::fs::remove_dir_all(&built);
        }
        Ok(Self { target, sysroot: Some(made.sysroot), programs, built })
    }

    /// Its standard library was made here, with the target's features; else it is the toolchain's own.
    pub(crate) const fn is_made(&self) -> bool {
        self.sysroot.is_some()
    }

    /// Cargo with this sysroot.
    pub(crate) fn cargo(&self, words: &[&str]) -> Command {
        let mut cargo = workspace::cargo();
        cargo.args(words).args(["--quiet", "--target", self.target.name]).arg("--target-dir").arg(&self.built);
        self.set_sysroot(&mut cargo);
        cargo
    }

    /// Has Cargo, or what starts it, use this sysroot.
    pub(crate) fn set_sysroot(&self, command: &mut Command) {
        if let Some(sysroot) = &self.sysroot {
            // As Cargo separates them: a path may have spaces.
            command.env("CARGO_ENCODED_RUSTFLAGS", format!("--sysroot\u{1f}{}", sysroot.display()));
        }
    }

    /// What was built in a profile.
    pub(crate) fn built(&self, profile: &str) -> PathBuf {
        self.built.join(self.target.name).join(profile)
    }
}

/// A sysroot that is made of the sources.
struct Made {
    target: Target,
    sysroot: PathBuf,
    toolchain: PathBuf,
    host: String,
    version: String,
}

impl Made {
    fn of(target: Target, toolchain: &Path, host: &str, version: &str) -> Self {
        let sysroot = folder().join(format!("{}-{version}", target.name));
        Self { target, sysroot, toolchain: toolchain.into(), host: host.into(), version: version.into() }
    }

    fn make(&self) -> Result<(), String> {
        let library = self.sources()?;
        say(format_args!("building {} for {}", self.target.crates, self.target.name));
        // Under another name until it is whole: what was cut short is begun again.
        let unfinished = self.sysroot.with_extension("unfinished");
        let failed = |error: std::io::Error| format!("{}: {error}", unfinished.display());
        let _ = std::fs::remove_dir_all(&unfinished);
        let rustlib = unfinished.join("lib/rustlib");
        let libraries = rustlib.join(self.target.name).join("lib");
        std::fs::create_dir_all(&libraries).map_err(failed)?;
        link(&self.toolchain.join("lib/rustlib").join(&self.host), &rustlib.join(&self.host))?;
        for built in self.build(&library, &unfinished.join("build"))? {
            let name = built.file_name().unwrap_or_default();
            std::fs::rename(&built, libraries.join(name)).map_err(failed)?;
        }
        let _ = std::fs::remove_dir_all(unfinished.join("build"));
        std::fs::rename(&unfinished, &self.sysroot).map_err(failed)
    }

    /// Has Cargo build the standard library for an empty package, which gives it all settings; returns the libraries.
    fn build(&self, library: &Path, folder: &Path) -> Result<Vec<PathBuf>, String> {
        let failed = |error: std::io::Error| format!("{}: {error}", folder.display());
        std::fs::create_dir_all(folder.join("src")).map_err(failed)?;
        let Target { opt_level, panic, .. } = self.target;
        let manifest = format!(
            "[package]\nname = \"empty\"\nedition = \"2024\"\n[workspace]\n[profile.release]\nopt-level = {opt_level}\npanic = \"{panic}\"\n"
        );
        std::fs::write(folder.join("Cargo.toml"), manifest).map_err(failed)?;
        std::fs::write(folder.join("src/lib.rs"), "#![no_std]\n").map_err(failed)?;
        let mut cargo = workspace::cargo();
        cargo
            .current_dir(folder)
            .args(["build", "--release", "--quiet", "--target-dir", "target", "--target"])
            .arg(self.target.name);
        cargo.arg(format!("-Zbuild-std={}", self.target.crates));
        cargo.arg(format!("-Zbuild-std-features={}", self.target.features));
        // Of this version alone, and from where they were unpacked: Cargo has no stable option for either.
        cargo.env("RUSTC_BOOTSTRAP", "1").env("__CARGO_TESTS_ONLY_SRC_ROOT", library);
        // With bitcode, as the libraries of a toolchain have it: a program may be optimised as a whole (LTO).
        cargo.env("CARGO_ENCODED_RUSTFLAGS", "-Cembed-bitcode=yes");
        builder::leave_out(&mut cargo);
        quietly(&mut cargo)?;
        let built = folder.join("target").join(self.target.name).join("release/deps");
        let files = std::fs::read_dir(built).map_err(failed)?.filter_map(|entry| Some(entry.ok()?.path()));
        let is_library = |path: &PathBuf| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            name.ends_with(".rlib") && !name.starts_with("libempty-")
        };
        Ok(files.filter(is_library).collect())
    }

    /// The sources of the standard library: the toolchain's own, or those of Debian's package of this version.
    fn sources(&self) -> Result<PathBuf, String> {
        let own = self.toolchain.join("lib/rustlib/src/rust/library");
        if own.is_dir() {
            return Ok(own);
        }
        let package = format!("rust-src={}+*", self.version);
        let unpacked = folder().join(format!("sources-{}", self.version));
        let library = unpacked.join(format!("usr/src/rustc-{}/library", self.version));
        if library.is_dir() {
            return Ok(library);
        }
        if !process::works("apt-get", &["--version"]) {
            return Err("there is no apt-get to download its sources with".into());
        }
        let lists = Lists::made()?;
        say(format_args!("downloading {package}"));
        let _ = std::fs::remove_dir_all(&unpacked);
        std::fs::create_dir_all(&unpacked).map_err(|error| error.to_string())?;
        let downloaded = quietly(lists.apt().args(["download", &package]).current_dir(&unpacked));
        downloaded.map_err(|error| format!("{package} cannot be downloaded: {}", last_line(&error)))?;
        let is_package = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "deb");
        let files = std::fs::read_dir(&unpacked).map_err(|error| error.to_string())?;
        let file =
            files.filter_map(|entry| Some(entry.ok()?.path())).find(is_package).ok_or("apt-get downloaded nothing")?;
        quietly(Command::new("dpkg-deb").arg("--extract").arg(&file).arg(&unpacked))?;
        let _ = std::fs::remove_file(&file);
        // Most of it is the compiler and what that is built with.
        for other in ["compiler", "src"] {
            let _ = std::fs::remove_dir_all(library.with_file_name(other));
        }
        if library.is_dir() { Ok(library) } else { Err(format!("{package} has other folders than expected")) }
    }
}

/// Package lists of more suites than the machine's own, apart from them.
struct Lists(PathBuf);

impl Lists {
    fn made() -> Result<Self, String> {
        let lists = Self(folder().join("apt"));
        let failed = |error: std::io::Error| format!("{}: {error}", lists.0.display());
        ["lists/partial", "cache/archives/partial"]
            .iter()
            .try_for_each(|name| std::fs::create_dir_all(lists.0.join(name)))
            .map_err(failed)?;
        // Where this machine gets its packages from, whatever mirror that is.
        let archives =
            output(Command::new("apt-get").args(["indextargets", "--format", "$(REPO_URI)", "Created-By: Packages"]))?;
        let archive = archives.lines().find(|line| line.trim_end_matches('/').ends_with("/debian"));
        let archive = archive.ok_or("this machine has no archive of Debian")?;
        let keys = "/usr/share/keyrings/debian-archive-keyring.gpg";
        let line = |suite: &&str| format!("deb [signed-by={keys}] {archive} {suite} main\n");
        std::fs::write(lists.0.join("sources"), SUITES.iter().map(line).collect::<String>()).map_err(failed)?;
        // A suite may be gone from the archive: the others count.
        let _ = quietly(lists.apt().arg("update"));
        Ok(lists)
    }

    fn apt(&self) -> Command {
        let mut apt = apt();
        let places = [("Etc::SourceList", "sources"), ("State::Lists", "lists"), ("Cache", "cache")];
        for (option, name) in places {
            apt.arg("-o").arg(format!("Dir::{option}={}", self.0.join(name).display()));
        }
        apt.args(["-o", "Dir::Etc::SourceParts=/dev/null"]);
        apt
    }
}

/// What is made here.
fn folder() -> PathBuf {
    workspace::target().join("sysroots")
}

fn rustc(words: &[&str]) -> Result<String, String> {
    output(Command::new("rustc").args(words))
}

fn host() -> Result<String, String> {
    let text = rustc(&["-vV"])?;
    let host = text.lines().find_map(|line| line.strip_prefix("host: "));
    host.map(str::to_owned).ok_or_else(|| "rustc -vV names no host".into())
}

/// Such as `1.95.0`.
fn version() -> Result<String, String> {
    let text = rustc(&["--version"])?;
    text.split_whitespace().nth(1).map(str::to_owned).ok_or_else(|| "rustc --version names no version".into())
}

#[cfg(unix)]
fn link(original: &Path, link: &Path) -> Result<(), String> {
    std::os::unix::fs::symlink(original, link).map_err(|error| format!("{}: {error}", link.display()))
}

#[cfg(not(unix))]
fn link(_: &Path, link: &Path) -> Result<(), String> {
    Err(format!("{}: links are made on Unix only", link.display()))
}
