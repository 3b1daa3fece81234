//! `cargo xtask web`: the studio's page with virtual drives in it, as files for any static host: the page, the simulator, master and
//! host as WebAssembly, and the JavaScript package of both for npm.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use crate::process::{self, quietly};
use crate::say::say;
use crate::site::{self, Sizes};
use crate::sysroot::{Rust, Target};
use crate::tally::Tally;
use crate::{builder, debian, npm, page, program, workspace};

/// A page, and node.
const TARGET: Target = Target {
    name: "wasm32-unknown-unknown",
    crates: "std,panic_abort",
    features: "optimize_for_size",
    opt_level: "\"z\"",
    panic: "abort",
};

/// A module that takes more is ended, which the page reports: the browser would end the tab without a word. The drives of a page take some ten MB.
const MOST_MEMORY: u32 = 1 << 30;

/// Most that a host may have to send for the page, in bytes by brotli, which browsers and most hosts have: the aim. By `gzip -9` it is a quarter more.
const MOST_SENT: u64 = 1_500_000;

/// What makes the module smaller, by npm: of the passes of `wasm-opt` those after which it is smaller when it is compressed, too. All of them
/// (`-Oz`) make it 10 % smaller, and larger when compressed.
const OPTIMISER: (&str, &str, &str) = ("binaryen", "132.0.0", "bin/wasm-opt");
const PASSES: &[&str] = &[
    "--duplicate-function-elimination",
    "--rse",
    "--vacuum",
    "--remove-unused-brs",
    "--optimize-instructions",
    "--vacuum",
    "--reorder-locals",
];

/// What runs the module, with the packages of Debian that they are in.
const PROGRAMS: &[(&str, &str)] = &[("node", "nodejs"), ("chromium", "chromium"), ("chromedriver", "chromium-driver")];

const HELP: &str = "usage: cargo xtask web [-o FOLDER]    (target/web/site without it)";

/// Runs `cargo xtask web`.
pub(crate) fn command(words: &[&str]) -> ExitCode {
    let folder = match words {
        [] => site(),
        ["-o", folder] => PathBuf::from(folder),
        _ => {
            eprintln!("{HELP}");
            return ExitCode::from(2);
        }
    };
    if !words.is_empty() && !may_be_replaced(&folder) {
        eprintln!(
            "{}: it is not empty, and not a page that this command has made; name a new folder",
            folder.display()
        );
        return ExitCode::from(2);
    }
    match Rust::found(TARGET, &self::folder()).and_then(|rust| make(&rust, &folder)) {
        Ok(made) => {
            made.left_large.iter().chain(&made.unordered).for_each(|note| println!("{note}"));
            match site::sizes(&folder) {
                Ok(sizes) => println!("{}", said(&sizes)),
                Err(error) => println!("its size when compressed is not known: {error}"),
            }
            println!("{}", folder.display());
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("no page: {error}");
            ExitCode::FAILURE
        }
    }
}

/// The step of `cargo xtask test`: the module runs as the native program does, in node and in a browser.
pub(crate) fn step() -> Tally {
    if let Err(reason) = debian::install(PROGRAMS) {
        return Tally::skipped(reason);
    }
    // A machine without the target cannot do this; a crate that does not compile for it is a failure.
    let rust = match Rust::found(TARGET, &folder()) {
        Ok(rust) => rust,
        Err(reason) => return Tally::skipped(reason),
    };
    let (folder, pictures) = (folder().join("tested"), folder().join("pictures"));
    let mut tally = match make(&rust, &folder) {
        Ok(made) => judge(&folder, made),
        Err(error) => return Tally::failed(error),
    };
    let program = match fs::create_dir_all(&pictures).map_err(|error| error.to_string()).and_then(|()| program::built())
    {
        Ok(program) => program,
        Err(error) => return Tally::failed(error),
    };
    // Another engine, for one test, which is skipped without it.
    let _ = debian::install(&[("firefox-esr", "firefox-esr")]);
    let mut node = Command::new("node");
    node.current_dir(workspace::root().join("crates/web"));
    node.env("SITE", folder).env("FERRODRIVE", program).env("PICTURES", pictures);
    node.env("SCENARIOS", workspace::root().join("examples/scenarios"));
    tally.add(&page::tests(&mut node, "site_tests/"));
    tally.add(&types());
    tally
}

/// Whether the page is what it should be before it runs: small, and without the folders of this machine.
fn judge(folder: &Path, made: Made) -> Tally {
    let mut tally = made.unordered.map_or_else(Tally::default, Tally::failed);
    match site::sizes(folder) {
        Ok(sizes) => {
            say(said(&sizes));
            let what = format!("{} bytes by brotli, and at most {MOST_SENT} are meant", sizes.brotli);
            tally.add(&match made.left_large {
                Some(why) if sizes.brotli > MOST_SENT => Tally::skipped(format!("{what}: {why}")),
                _ => Tally::of_check(sizes.brotli <= MOST_SENT, &what),
            });
        }
        Err(error) => tally.add(&Tally::failed(error)),
    }
    match builder::named_in(&folder.join("ferrodrive.wasm")) {
        Ok(named) => tally.add(&Tally::of_check(named.is_none(), &named.unwrap_or_default())),
        Err(error) => tally.add(&Tally::failed(error)),
    }
    tally
}

fn said(sizes: &Sizes) -> String {
    let Sizes { module_gzip, gzip, brotli } = sizes;
    format!("{gzip} bytes in all by gzip -9, of which the module is {module_gzip}; {brotli} by brotli")
}

/// The types of the package, by a program that uses them.
fn types() -> Tally {
    let (name, version, file) = page::TYPESCRIPT;
    match npm::install(name, version, file) {
        Ok(compiler) => {
            let mut node = Command::new("node");
            node.current_dir(workspace::root().join("crates/web")).arg(compiler).args(["-p", "jsconfig.json"]);
            match process::run(&mut node, |line| say(line)) {
                Ok(ok) => Tally::of_check(ok, "types of the package"),
                Err(error) => Tally::failed(error),
            }
        }
        Err(reason) => Tally::skipped(reason),
    }
}

/// What is made here.
fn folder() -> PathBuf {
    workspace::target().join("web")
}

/// Where the page is made by default.
fn site() -> PathBuf {
    folder().join("site")
}

/// Whether the folder is new, empty, or one that was made here: what stands in it is removed.
fn may_be_replaced(folder: &Path) -> bool {
    let is_ours = folder.join("ferrodrive.wasm").is_file() && folder.join("index.html").is_file();
    is_ours
        || fs::read_dir(folder)
            .map_or_else(|error| error.kind() == io::ErrorKind::NotFound, |mut found| found.next().is_none())
}

/// What could not be done to make the page small.
struct Made {
    /// What this machine lacks.
    left_large: Option<String>,
    /// What of the module is unknown here.
    unordered: Option<String>,
}

/// Makes the page in a folder.
fn make(rust: &Rust, folder: &Path) -> Result<Made, String> {
    const PROFILE: &str = "web";
    let words = ["rustc", "--profile", PROFILE, "--package", "ferrodrive-web", "--crate-type", "cdylib"];
    let mut cargo = rust.cargo(&words);
    builder::leave_out(&mut cargo);
    quietly(cargo.arg("--").arg(format!("-Clink-arg=--max-memory={MOST_MEMORY}")))?;
    let (built, small) = (rust.built(PROFILE).join("web.wasm"), self::folder().join("ferrodrive.wasm"));
    let own = || (!rust.is_made()).then(|| "the standard library is the toolchain's own, which is larger".into());
    let (module, left_large) = match optimised(&built, &self::folder().join("optimised.wasm")) {
        Ok(optimised) => (optimised, own()),
        Err(why) => (built, Some(why)),
    };
    let unordered = match site::ordered(&module) {
        Ok(ordered) => {
            fs::write(&small, ordered).map_err(|error| format!("{}: {error}", small.display()))?;
            None
        }
        Err(why) => {
            fs::copy(&module, &small).map_err(|error| format!("{}: {error}", small.display()))?;
            Some(why)
        }
    };
    site::make(&small, folder).map(|()| Made { left_large, unordered })
}

/// The same module, smaller.
fn optimised(module: &Path, optimised: &Path) -> Result<PathBuf, String> {
    let (name, version, file) = OPTIMISER;
    let mut node = Command::new("node");
    node.arg(npm::install(name, version, file)?).arg(module).arg("-o").arg(optimised).args(PASSES);
    quietly(&mut node).map_err(|error| format!("{name} did not make the module smaller: {error}"))?;
    Ok(optimised.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_of_others_is_not_replaced() {
        let folder = workspace::target().join(format!("tmp/replaced-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        assert!(may_be_replaced(&folder), "it is not there");
        fs::create_dir_all(&folder).expect("a folder");
        assert!(may_be_replaced(&folder), "it is empty");
        fs::write(folder.join("index.html"), "").expect("a file");
        assert!(!may_be_replaced(&folder), "the page of others");
        fs::write(folder.join("ferrodrive.wasm"), "").expect("a file");
        assert!(may_be_replaced(&folder), "one that was made here");
        assert!(!may_be_replaced(&folder.join("index.html")), "a file");
        fs::remove_dir_all(&folder).expect("to remove it");
    }
}
