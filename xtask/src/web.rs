//! `cargo xtask web`: the studio's page with virtual drives in it, as files for any static host: the page, the simulator, master and
//! host as WebAssembly, and the JavaScript package of both for npm.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use serde_json::json;
use sha2::{Digest, Sha256};

use crate::dist::{copy, write};
use crate::process::{self, quietly};
use crate::say::say;
use crate::sysroot::{Rust, Target};
use crate::tally::Tally;
use crate::{debian, page, program, wasm_order, workspace};

/// A page, and node.
const TARGET: Target = Target {
    name: "wasm32-unknown-unknown",
    crates: "std,panic_abort",
    features: "optimize_for_size",
    opt_level: "\"z\"",
    panic: "abort",
};

/// Nothing is fetched from anywhere but the page's own host, and nothing in the page is a script but its files.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; \
     worker-src 'self'; form-action 'none'; base-uri 'none'";

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
    let module = Rust::found(TARGET, &self::folder()).and_then(|rust| module(&rust, "web"));
    match module.and_then(|module| make(&module, &folder)) {
        Ok(()) => {
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
    let module = match module(&rust, "web") {
        Ok(module) => module,
        Err(error) => return Tally::failed(error),
    };
    let (folder, pictures) = (folder().join("tested"), folder().join("pictures"));
    let made = make(&module, &folder).and_then(|()| fs::create_dir_all(&pictures).map_err(|error| error.to_string()));
    let program = match made.and_then(|()| program::built()) {
        Ok(program) => program,
        Err(error) => return Tally::failed(error),
    };
    let mut node = Command::new("node");
    node.current_dir(workspace::root().join("crates/web"));
    node.env("SITE", folder).env("FERRODRIVE", program).env("PICTURES", pictures);
    page::tests(node.env("SCENARIOS", workspace::root().join("examples/scenarios")), "site_tests/")
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

/// Builds the module in a profile.
fn module(rust: &Rust, profile: &str) -> Result<PathBuf, String> {
    let words = ["rustc", "--profile", profile, "--package", "ferrodrive-web", "--crate-type", "cdylib"];
    quietly(&mut rust.cargo(&words))?;
    Ok(rust.built(profile).join("web.wasm"))
}

/// Makes the folder anew around a module.
fn make(module: &Path, folder: &Path) -> Result<(), String> {
    let _ = fs::remove_dir_all(folder);
    let (own, page) = (workspace::root().join("crates/web"), workspace::root().join("crates/studio/page"));
    for path in files(&page)?.into_iter().filter(|path| has_ending(path, &["js", "css"])) {
        copy(&path, &folder.join("page").join(name(&path)))?;
    }
    for path in files(&own.join("js"))? {
        copy(&path, &folder.join(name(&path)))?;
    }
    write_ordered(module, &folder.join("ferrodrive.wasm"))?;
    write(&folder.join("index.html"), &index(&read(&page.join("index.html"))?, &own)?)?;
    keep_offline(folder)?;
    pack(folder)?;
    let bytes: u64 = all_files(folder)?.iter().filter_map(|path| fs::metadata(path).ok()).map(|file| file.len()).sum();
    say(format_args!("{bytes} bytes in all"));
    Ok(())
}

/// Writes the module with its functions in an order that compresses well; as it is, if it has what is not known there.
fn write_ordered(module: &Path, to: &Path) -> Result<(), String> {
    let built = fs::read(module).map_err(|error| format!("{}: {error}", module.display()))?;
    let ordered = wasm_order::ordered(&built).unwrap_or_else(|why| {
        say(format_args!("the module's functions are left in their order: {why}"));
        built
    });
    fs::write(to, ordered).map_err(|error| format!("{}: {error}", to.display()))
}

/// The studio's page that has its host in a worker.
fn index(page: &str, own: &Path) -> Result<String, String> {
    let examples = workspace::root().join("examples");
    let machine = read(&own.join("machine.toml"))?;
    let machines = [
        ("A base, a joint, a stepper axis", machine.clone()),
        ("A base on two hub motors", read(&examples.join("base.toml"))?),
        ("A wheel, a joint and a stepper, with noise", read(&examples.join("machine.toml"))?),
    ];
    let machines: Vec<_> = machines.map(|(title, text)| json!({ "title": title, "text": text })).into();
    let mut scenarios = Vec::new();
    for path in files(&examples.join("scenarios"))?.iter().filter(|path| has_ending(path, &["toml"])) {
        let text = read(path)?;
        let title =
            text.lines().find_map(|line| line.strip_prefix("title = ")).map(|title| title.trim_matches('"').to_owned());
        // A page has no machine file beside a scenario.
        if text.lines().any(|line| line.starts_with("machine =")) {
            continue;
        }
        scenarios.push(json!({ "title": title.unwrap_or_else(|| name(path)), "text": text }));
    }
    let given = json!({ "machines": machines, "scenarios": scenarios }).to_string();
    let head = format!(
        "<meta http-equiv=\"content-security-policy\" content=\"{POLICY}\">\n<script type=\"application/json\" id=\"given\">{}</script>\n\
         <script type=\"text/plain\" id=\"machine\">{machine}</script>\n<script type=\"module\" src=\"begin.js\"></script>\n",
        // Where a script ends is decided before JSON is read.
        given.replace('<', "\\u003c"),
    );
    let changes = [
        ("<html lang=\"en\">", "<html lang=\"en\" data-worker=\"worker.js\">".to_owned()),
        ("<meta charset=\"utf-8\">\n", format!("<meta charset=\"utf-8\">\n{head}")),
        ("</head>", "<link rel=\"stylesheet\" href=\"web.css\">\n<script type=\"module\" src=\"machines.js\"></script>\n<script type=\"module\" src=\"serial.js\"></script>\n</head>".to_owned()),
    ];
    changes.iter().try_fold(page.to_owned(), |page, (from, to)| {
        if page.matches(from).count() != 1 {
            Err(format!("the page has not one {from:?}"))
        } else {
            Ok(page.replace(from, to))
        }
    })
}

/// Writes into the service worker which files there are, and a name for this very content.
fn keep_offline(folder: &Path) -> Result<(), String> {
    let (mut list, mut sum) = (vec!["./".to_owned(), "index.html".to_owned()], Sha256::new());
    for path in all_files(folder)? {
        sum.update(fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?);
        let name = path.strip_prefix(folder).unwrap_or(&path).to_string_lossy().replace('\\', "/");
        if has_ending(&path, &["js", "css", "wasm"]) && name != "offline.js" {
            list.push(name);
        }
    }
    let version: String = sum.finalize().iter().take(8).map(|byte| format!("{byte:02x}")).collect();
    let path = folder.join("offline.js");
    let text = format!("const VERSION = {version:?};\nconst FILES = {};\n\n{}", json!(list), read(&path)?);
    write(&path, &text)
}

/// The package for npm, in `ferrodrive-VERSION.tgz` of the folder.
fn pack(folder: &Path) -> Result<(), String> {
    let package = self::folder().join("npm");
    let _ = fs::remove_dir_all(&package);
    for name in ["ferrodrive.js", "ferrodrive.d.ts", "ferrodrive.wasm"] {
        copy(&folder.join(name), &package.join(name))?;
    }
    for name in ["LICENSE-APACHE", "LICENSE-MIT"] {
        copy(&workspace::root().join(name), &package.join(name))?;
    }
    copy(&workspace::root().join("crates/web/README.md"), &package.join("README.md"))?;
    let manifest = json!({
        "name": "ferrodrive",
        "version": env!("CARGO_PKG_VERSION"),
        "description": "CANopen motor drives as firmware and physics in virtual time, for pages and node",
        "license": "MIT OR Apache-2.0",
        "type": "module",
        "exports": { ".": { "types": "./ferrodrive.d.ts", "default": "./ferrodrive.js" } },
        "types": "./ferrodrive.d.ts",
        "engines": { "node": ">=18" },
        "keywords": ["canopen", "cia402", "can", "servo", "simulation"],
    });
    write(&package.join("package.json"), &format!("{manifest:#}\n"))?;
    if !process::works("npm", &["--version"]) {
        say("no package for npm: npm is not installed");
        return Ok(());
    }
    quietly(
        Command::new("npm")
            .current_dir(&package)
            .args(["pack", "--offline", "--pack-destination"])
            .arg(absolute(folder)?),
    )
}

fn absolute(path: &Path) -> Result<PathBuf, String> {
    std::path::absolute(path).map_err(|error| format!("{}: {error}", path.display()))
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn has_ending(path: &Path, endings: &[&str]) -> bool {
    path.extension().is_some_and(|ending| endings.iter().any(|known| ending == *known))
}

/// The files of a folder, in order.
fn files(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let entries = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).filter(|path| path.is_file()).collect();
    paths.sort();
    Ok(paths)
}

/// The files of a page.
fn all_files(folder: &Path) -> Result<Vec<PathBuf>, String> {
    Ok([files(folder)?, files(&folder.join("page"))?].concat())
}

fn read(path: &Path) -> Result<String, String> {
    fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))
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
