//! The folder of static files that `cargo xtask web` makes: the studio's page with a host in a worker, its scripts in two files, the module,
//! what keeps all of it for later, and the package for npm.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::json;
use sha2::{Digest, Sha256};

use crate::dist::{copy, write};
use crate::process::{output, quietly, works};
use crate::say::say;
use crate::{wasm_order, workspace};
use bundle::{Module, bundles};

/// What the studio bundles its own page with.
#[path = "../../crates/studio/src/web/bundle.rs"]
mod bundle;

/// Nothing is fetched from anywhere but the page's own host, and nothing in the page is a script but its files. A worker compiles the module; it
/// has the policy of its own answer, so that this has to hold as a header of every file too.
pub(crate) const POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data:; \
     connect-src 'self'; worker-src 'self'; form-action 'none'; base-uri 'none'";

/// The scripts of the page: its modules in two files, the second one for what the first picture does not need.
const BUNDLE: &str = "bundle.js";
const LATER: &str = "later.js";

/// The modules of `crates/web/js` that the page itself runs; the others are of workers, and of the package.
const OF_PAGE: &[&str] = &["begin.js", "machines.js", "serial.js"];

/// Where the page begins: what the address holds, before anything else.
const ENTRY: Module<'_> = (
    "entry.js",
    "import {} from \"./begin.js\";\nimport {} from \"./main.js\";\nimport {} from \"./machines.js\";\nimport {} from \"./serial.js\";\n",
);

/// What a host sends for the page, in bytes.
pub(crate) struct Sizes {
    /// The module alone, by `gzip -9`.
    pub(crate) module_gzip: u64,
    /// Everything that the page has.
    pub(crate) gzip: u64,
    pub(crate) brotli: u64,
}

/// Makes the folder anew around a module.
pub(crate) fn make(module: &Path, folder: &Path) -> Result<(), String> {
    let _ = fs::remove_dir_all(folder);
    let (own, page) = (workspace::root().join("crates/web"), workspace::root().join("crates/studio/page"));
    scripts(&page, &own.join("js"), folder)?;
    write(&folder.join("page/style.css"), &(read(&page.join("style.css"))? + &read(&own.join("js/web.css"))?))?;
    for path in files(&own.join("js"))? {
        if !OF_PAGE.contains(&name(&path).as_str()) && !has_ending(&path, &["css"]) {
            copy(&path, &folder.join(name(&path)))?;
        }
    }
    copy(module, &folder.join("ferrodrive.wasm"))?;
    write(&folder.join("index.html"), &index(&read(&page.join("index.html"))?, &own)?)?;
    keep_offline(folder)?;
    pack(folder)
}

/// The module as it is delivered: its functions in an order that compresses well.
pub(crate) fn ordered(module: &Path) -> Result<Vec<u8>, String> {
    let built = fs::read(module).map_err(|error| format!("{}: {error}", module.display()))?;
    wasm_order::ordered(&built).map_err(|why| format!("the module's functions are left in their order: {why}"))
}

/// The modules of the page, and those of this one, as two scripts.
fn scripts(page: &Path, own: &Path, folder: &Path) -> Result<(), String> {
    let mut sources = vec![(ENTRY.0.to_owned(), ENTRY.1.to_owned())];
    for path in files(page)?.iter().filter(|path| has_ending(path, &["js"])) {
        sources.push((name(path), read(path)?));
    }
    for file in OF_PAGE {
        sources.push(((*file).to_owned(), read(&own.join(file))?.replace("from \"./page/", "from \"./")));
    }
    let sources: Vec<Module<'_>> = sources.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect();
    let [first, later] = bundles(&sources, ENTRY.0, BUNDLE, LATER);
    write(&folder.join("page").join(BUNDLE), &first)?;
    write(&folder.join("page").join(LATER), &later)
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
        let files = match text.lines().find_map(|line| line.strip_prefix("machine = ")) {
            // A page has no files beside a scenario: it is given the machine by the name that the scenario has for it.
            Some(beside) => {
                let beside = beside.trim_matches('"');
                json!({ beside: read(&examples.join("scenarios").join(beside))? })
            }
            None => json!({}),
        };
        scenarios.push(json!({ "title": title.unwrap_or_else(|| name(path)), "text": text, "files": files }));
    }
    let given = json!({ "machines": machines, "scenarios": scenarios }).to_string();
    let head = format!(
        "<meta http-equiv=\"content-security-policy\" content=\"{POLICY}\">\n<script type=\"application/json\" id=\"given\">{}</script>\n\
         <script type=\"text/plain\" id=\"machine\">{machine}</script>\n",
        // Where a script ends is decided before JSON is read.
        given.replace('<', "\\u003c"),
    );
    let changes = [
        ("<html lang=\"en\">", "<html lang=\"en\" data-worker=\"worker.js\">".to_owned()),
        ("<meta charset=\"utf-8\">\n", format!("<meta charset=\"utf-8\">\n{head}")),
        ("page/main.js", format!("page/{BUNDLE}")),
    ];
    changes.iter().try_fold(page.to_owned(), |page, (from, to)| {
        if page.matches(from).count() != 1 {
            Err(format!("the page has not one {from:?}"))
        } else {
            Ok(page.replace(from, to))
        }
    })
}

/// What a host sends for the page: all that its service worker keeps, which is all that a first visit fetches.
pub(crate) fn sizes(folder: &Path) -> Result<Sizes, String> {
    let script = "const { gzipSync, brotliCompressSync } = require('node:zlib');
        for (const path of process.argv.slice(1)) {
            const content = require('node:fs').readFileSync(path);
            console.log(gzipSync(content, { level: 9 }).length, brotliCompressSync(content).length);
        }";
    let is_sent = |path: &PathBuf| has_ending(path, &["html", "js", "css", "wasm"]);
    let paths: Vec<_> = all_files(folder)?.into_iter().filter(is_sent).collect();
    let said = output(Command::new("node").args(["-e", script]).args(&paths))?;
    let mut sizes = Sizes { module_gzip: 0, gzip: 0, brotli: 0 };
    for (path, line) in paths.iter().zip(said.lines()) {
        let (gzip, brotli) = line.split_once(' ').ok_or("node says no sizes")?;
        let number = |text: &str| text.parse::<u64>().map_err(|error| format!("{text}: {error}"));
        (sizes.gzip, sizes.brotli) = (sizes.gzip + number(gzip)?, sizes.brotli + number(brotli)?);
        if has_ending(path, &["wasm"]) {
            sizes.module_gzip = number(gzip)?;
        }
    }
    Ok(sizes)
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
    let package = workspace::target().join("web/npm");
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
    if !works("npm", &["--version"]) {
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
