//! What the pages say is in the tree: each piece of code in the file that is named before it, each path, each package and
//! test of a `cargo` line. The `ferrodrive` lines of the pages run in `tests/processes/tests/real_time/handbook.rs`.

use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The pages: name and text.
fn pages() -> Vec<(String, String)> {
    let folder = std::fs::read_dir(root().join("docs/handbook")).expect("the handbook is there");
    let paths = folder.map(|entry| entry.expect("a readable folder").path());
    let pages: Vec<_> = paths
        .map(|path| {
            let text = std::fs::read_to_string(&path).expect("a page is text");
            (path.file_name().unwrap_or_default().to_string_lossy().into_owned(), text)
        })
        .collect();
    assert!(pages.len() >= 4, "{pages:?}");
    pages
}

/// The blocks of one language: what stands before each, and its lines.
fn blocks(text: &str, language: &str) -> Vec<(String, Vec<String>)> {
    let mut found = Vec::new();
    let mut before = String::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let Some(opened) = line.strip_prefix("```") else {
            before.push_str(line);
            before.push('\n');
            continue;
        };
        let block = lines.by_ref().take_while(|line| !line.starts_with("```")).map(str::to_owned).collect();
        if opened == language {
            found.push((before.clone(), block));
        }
    }
    found
}

/// What is in backticks and looks like a path of the project.
fn paths(text: &str) -> Vec<&str> {
    let folders = ["crates/", "docs/", "tests/", "examples/", "fuzz/", "xtask/"];
    let quoted = text.split('`').skip(1).step_by(2);
    quoted
        .filter(|word| folders.iter().any(|folder| word.starts_with(folder)) && !word.contains(char::is_whitespace))
        .collect()
}

/// Whether the lines of a block are in a file, one after another; `...` stands for lines that are left out.
fn stands_in(file: &str, block: &[String]) -> bool {
    let file: Vec<&str> = file.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    let mut from = 0;
    block.split(|line| line.trim() == "...").all(|part| {
        let part: Vec<&str> = part.iter().map(|line| line.trim()).filter(|line| !line.is_empty()).collect();
        let at = part.is_empty().then_some(from).or_else(|| {
            (from..file.len().saturating_sub(part.len() - 1)).find(|at| file[*at..*at + part.len()] == part[..])
        });
        from = at.map_or(from, |at| at + part.len());
        at.is_some()
    })
}

/// Pages whose pieces of code are run as they stand there, and by what.
const RUN: [(&str, &str); 2] =
    [("fmu.md", "tests/peers/fmu.py"), ("physics-engine.md", "examples/mujoco/test_mujoco.py")];

#[test]
fn each_piece_of_code_stands_in_the_file_that_is_named_before_it() {
    let mut pieces = 0;
    for (page, runner) in RUN {
        let runner = std::fs::read_to_string(root().join(runner)).unwrap_or_else(|error| panic!("{runner}: {error}"));
        assert!(runner.contains(page), "{page} is run");
    }
    for (page, text) in pages().into_iter().filter(|(page, _)| !RUN.iter().any(|(run, _)| run == page)) {
        for (before, block) in ["rust", "python", "csv"].iter().flat_map(|language| blocks(&text, language)) {
            let path = *paths(&before).last().unwrap_or_else(|| panic!("{page}: no file is named before {block:?}"));
            let file =
                std::fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{page}: {path}: {error}"));
            assert!(stands_in(&file, &block), "{page}: not in {path}:\n{}", block.join("\n"));
            pieces += 1;
        }
    }
    assert!(pieces >= 4, "{pieces}");
}

#[test]
fn a_piece_that_is_not_in_its_file_is_noticed() {
    let block = |text: &str| text.lines().map(str::to_owned).collect::<Vec<_>>();
    let file = "fn a() {\n    b();\n    c();\n}\n";
    assert!(stands_in(file, &block("fn a() {\n    b();")) && stands_in(file, &block("fn a() {\n...\n}")));
    assert!(!stands_in(file, &block("fn a() {\n    c();")) && !stands_in(file, &block("c();\n...\nb();")));
}

#[test]
fn each_path_that_a_page_names_exists() {
    for (page, text) in pages() {
        for path in paths(&text).into_iter().filter(|path| !path.contains("DRIVE")) {
            assert!(root().join(path).exists(), "{page}: {path}");
        }
    }
}

#[test]
fn each_cargo_line_names_a_package_and_a_test_that_exist() {
    let manifests: Vec<String> = ["crates", "."]
        .iter()
        .flat_map(|folder| std::fs::read_dir(root().join(folder)).expect("a folder"))
        .filter_map(|entry| std::fs::read_to_string(entry.ok()?.path().join("Cargo.toml")).ok())
        .collect();
    for (page, text) in pages() {
        for line in blocks(&text, "sh").into_iter().flat_map(|(_, block)| block) {
            let words: Vec<&str> = line.split('#').next().unwrap_or_default().split_whitespace().collect();
            for pair in words.windows(2).filter(|_| words[0] == "cargo") {
                let package = format!("name = \"{}\"", pair[1]);
                assert!(pair[0] != "-p" || manifests.iter().any(|text| text.contains(&package)), "{page}: {line}");
                let test = root().join("tests/tests").join(pair[1]);
                let there = test.is_dir() || test.with_extension("rs").exists();
                assert!(pair[0] != "--test" || there, "{page}: {line}");
            }
        }
    }
}

/// The line of the workflow that asks the device, as it stands there: on a virtual bus in place of the runner's interface.
#[test]
fn the_workflow_on_conformance_asks_the_device_and_writes_what_it_keeps() {
    let text = std::fs::read_to_string(root().join("docs/handbook/ci.md")).expect("the page is there");
    let workflows = blocks(&text, "yaml").into_iter().map(|(_, block)| block);
    let workflow = workflows.into_iter().find(|block| block[0] == "name: conformance").expect("a workflow");
    let line =
        workflow.iter().find_map(|line| line.trim().strip_prefix("- run: ferrodrive conform ")).expect("its line");
    let words: Vec<&str> = ["conform"].into_iter().chain(line.split_whitespace()).collect();
    let folder = processes::scratch("handbook-conformance");
    std::fs::copy(root().join("crates/words/src/models/io401.eds"), folder.join("my-device.eds")).expect("an EDS");
    std::fs::write(folder.join("machine.toml"), "[[drive]]\nmodel = \"my-device.eds\"\nnode = 5\n").expect("a file");
    let mut command = processes::command(&words);
    let ended =
        command.current_dir(&*folder).env("FERRODRIVE_BUS", "sim:machine.toml").output().expect("the binary runs");
    let said = String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.success(), "{said}{}", String::from_utf8_lossy(&ended.stdout));
    for (file, part) in [("conformance.xml", "<testsuite"), ("conformance.html", "No case failed")] {
        let written = std::fs::read_to_string(folder.join(file)).expect("it is written");
        assert!(written.contains(part), "{file}: {written}");
    }
    let kept = workflow.iter().any(|line| line.trim() == "path: conformance.*");
    assert!(kept, "what is written is what the workflow keeps");
}
