//! The core crates on a microcontroller: they build for a Cortex-M4F, and what two programs of them take of flash and RAM.
//!
//! Where rustup's target is missing, and no rustup is at hand to add it, Debian's package of the sources of the same version of
//! Rust gives `core` and `compiler_builtins`, which are built into a sysroot beside everything else that Cargo builds. That
//! takes half a minute once.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};

use crate::debian::{apt, last_line};
use crate::process::{self, output, quietly};
use crate::say::say;
use crate::tally::Tally;
use crate::{tidy, workspace};

/// A microcontroller with a floating-point unit and no operating system.
const TARGET: &str = "thumbv7em-none-eabihf";

/// The suites of Debian that have had more than one version of Rust.
const SUITES: [&str; 5] = ["bookworm-backports", "trixie-backports", "trixie", "testing", "unstable"];

/// The programs of `benches/bare_metal`: where each begins, and what it is.
const PROGRAMS: [(&str, &str); 2] =
    [("node_main", "a node with 30 objects"), ("zlac8030l_main", "the whole ZLAC8030L")];

pub(crate) fn step() -> Tally {
    let rust = match Rust::found() {
        Ok(rust) => rust,
        Err(reason) => return Tally::skipped(format!("{reason}; or: rustup target add {TARGET}")),
    };
    match rust.check().and_then(|()| rust.sizes()) {
        Ok(lines) => {
            lines.iter().for_each(say);
            Tally::of_check(true, "")
        }
        Err(error) => Tally::failed(error),
    }
}

/// What the step takes of others.
pub(crate) fn fetch() -> Result<(), String> {
    Rust::found().map(|_| ())
}

/// A Rust that builds for the target.
struct Rust {
    /// Where its `core` is, if not in the toolchain itself.
    sysroot: Option<PathBuf>,
    /// The folder of the toolchain's own programs, with the linker.
    programs: PathBuf,
}

impl Rust {
    fn found() -> Result<Self, String> {
        let sysroot = PathBuf::from(rustc(&["--print", "sysroot"])?.trim());
        let host = host()?;
        let programs = sysroot.join("lib/rustlib").join(&host).join("bin");
        if Path::new(rustc(&["--print", "target-libdir", "--target", TARGET])?.trim()).is_dir() {
            return Ok(Self { sysroot: None, programs });
        }
        let made = Made::of(&sysroot, &host, &version()?);
        made.make().map_err(|error| format!("the target {TARGET} is not installed, and cannot be made: {error}"))?;
        Ok(Self { sysroot: Some(made.sysroot), programs })
    }

    /// Cargo with this sysroot, in a folder of its own: the flags are other ones than everybody's.
    fn cargo(&self, words: &[&str]) -> Command {
        let mut cargo = workspace::cargo();
        cargo.args(words).args(["--quiet", "--target", TARGET]).arg("--target-dir").arg(folder().join("build"));
        if let Some(sysroot) = &self.sysroot {
            // As Cargo separates them: a path may have spaces.
            cargo.env("CARGO_ENCODED_RUSTFLAGS", format!("--sysroot\u{1f}{}", sysroot.display()));
        }
        cargo
    }

    fn check(&self) -> Result<(), String> {
        let packages = tidy::NO_STD.iter().flat_map(|name| ["--package".to_owned(), format!("ferrodrive-{name}")]);
        quietly(self.cargo(&["check"]).args(packages))
    }

    /// Links both programs and says what each takes.
    fn sizes(&self) -> Result<Vec<String>, String> {
        let words = ["rustc", "--profile", "flash", "--package", "ferrodrive-bare-metal", "--crate-type", "staticlib"];
        quietly(&mut self.cargo(&words))?;
        let library = folder().join("build").join(TARGET).join("flash/libbare_metal.a");
        PROGRAMS.iter().map(|(entry, what)| self.size(&library, entry).map(|size| format!("{what}: {size}"))).collect()
    }

    fn size(&self, library: &Path, entry: &str) -> Result<String, String> {
        let image = folder().join(entry);
        let mut linker = Command::new(self.programs.join("rust-lld"));
        // What is missing are the board's own functions, which are nobody's here.
        linker.args(["-flavor", "gnu", "--gc-sections", "--unresolved-symbols=ignore-all", "-e", entry, "-u", entry]);
        quietly(linker.arg(library).arg("-o").arg(&image))?;
        let bytes = std::fs::read(&image).map_err(|error| format!("{}: {error}", image.display()))?;
        let size = Size::of(&bytes).ok_or_else(|| format!("{} is not an ELF image of 32 bits", image.display()))?;
        Ok(format!("{} bytes of flash, {} bytes of RAM beside its stack", size.flash, size.ram))
    }
}

/// What an image takes of a microcontroller's two memories.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Size {
    /// Code, constants, and the values from which variables start.
    flash: u32,
    /// Variables.
    ram: u32,
}

impl Size {
    /// Adds up the sections of a little-endian ELF image of 32 bits that have a place in memory.
    fn of(image: &[u8]) -> Option<Self> {
        const ALLOCATED: u32 = 2;
        const WRITABLE: u32 = 1;
        const WITHOUT_BYTES: u32 = 8;
        let half = |at: usize| Some(u16::from_le_bytes(image.get(at..at + 2)?.try_into().ok()?));
        let word = |at: usize| Some(u32::from_le_bytes(image.get(at..at + 4)?.try_into().ok()?));
        if image.get(..6)? != b"\x7fELF\x01\x01" {
            return None;
        }
        let (first, length, count) = (word(0x20)? as usize, usize::from(half(0x2E)?), usize::from(half(0x30)?));
        let mut size = Self::default();
        for section in (0..count).map(|number| first + number * length) {
            let (kind, flags, bytes) = (word(section + 4)?, word(section + 8)?, word(section + 20)?);
            if flags & ALLOCATED == 0 {
                continue;
            }
            size.ram += if flags & WRITABLE == 0 { 0 } else { bytes };
            size.flash += if kind == WITHOUT_BYTES { 0 } else { bytes };
        }
        Some(size)
    }
}

/// A sysroot that is made of the sources.
struct Made {
    sysroot: PathBuf,
    toolchain: PathBuf,
    host: String,
    version: String,
}

impl Made {
    fn of(toolchain: &Path, host: &str, version: &str) -> Self {
        let sysroot = folder().join(format!("sysroot-{version}"));
        Self { sysroot, toolchain: toolchain.into(), host: host.into(), version: version.into() }
    }

    fn make(&self) -> Result<(), String> {
        // A second step finds what the first has made.
        static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
        let _alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
        if self.sysroot.is_dir() {
            return Ok(());
        }
        let library = self.sources()?;
        say(format_args!("building core for {TARGET}"));
        // Under another name until it is whole: what was cut short is begun again.
        let unfinished = self.sysroot.with_extension("unfinished");
        let rustlib = unfinished.join("lib/rustlib");
        let libraries = rustlib.join(TARGET).join("lib");
        let _ = std::fs::remove_dir_all(&unfinished);
        std::fs::create_dir_all(&libraries).map_err(|error| error.to_string())?;
        link(&self.toolchain.join("lib/rustlib").join(&self.host), &rustlib.join(&self.host))?;
        let rustc = || {
            let mut rustc = Command::new("rustc");
            rustc.env("RUSTC_BOOTSTRAP", "1").args([
                "--edition",
                "2024",
                "--crate-type",
                "rlib",
                "--cap-lints",
                "allow",
            ]);
            rustc.args([
                "--target",
                TARGET,
                "-Copt-level=s",
                "-Cpanic=abort",
                "-Cmetadata=made",
                "-Cextra-filename=-made",
            ]);
            rustc.args(["-Zforce-unstable-if-unmarked", "--out-dir"]).arg(&libraries).arg("--sysroot").arg(&unfinished);
            rustc
        };
        quietly(rustc().args(["--crate-name", "core"]).arg(library.join("core/src/lib.rs")))?;
        // What its build script sets for a Cortex-M.
        let settings = ["thumb", "intrinsics_enabled", "arch_enabled", "optimizations_enabled"].map(str::to_owned);
        let features = ["compiler-builtins", "mem", "unstable-intrinsics"].map(|name| format!("feature=\"{name}\""));
        let mut builtins = rustc();
        builtins.env("CFG_OPT_LEVEL", "s").env("CFG_TARGET_FEATURES", "[]");
        builtins.args(settings.iter().chain(&features).flat_map(|name| ["--cfg", name]));
        builtins.args(["--crate-name", "compiler_builtins"]);
        quietly(builtins.arg(library.join("compiler-builtins/compiler-builtins/src/lib.rs")))?;
        std::fs::rename(&unfinished, &self.sysroot).map_err(|error| error.to_string())
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

/// What is made here, by this step alone.
fn folder() -> PathBuf {
    workspace::target().join("bare_metal")
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A header and three sections, with only the fields that count.
    fn image(sections: &[(u32, u32, u32)]) -> Vec<u8> {
        let mut image = vec![0; 52];
        image[..6].copy_from_slice(b"\x7fELF\x01\x01");
        image[0x20] = 52;
        image[0x2E] = 40;
        image[0x30] = sections.len() as u8;
        for (kind, flags, bytes) in sections {
            let words = [0, *kind, *flags, 0, 0, *bytes, 0, 0, 0, 0];
            image.extend(words.iter().flat_map(|word| word.to_le_bytes()));
        }
        image
    }

    #[test]
    fn variables_with_a_value_count_in_both_memories_and_debug_information_in_none() {
        // Code, constants, variables with a value, variables that start at 0, debug information.
        let image = image(&[(1, 6, 1000), (1, 2, 300), (1, 3, 20), (8, 3, 4000), (1, 0, 9999)]);
        assert_eq!(Size::of(&image), Some(Size { flash: 1320, ram: 4020 }));
        assert_eq!(Size::of(&image[..100]), None);
        assert_eq!(Size::of(b"MZ"), None);
    }
}
