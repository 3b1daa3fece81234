//! The stacks of other people, and how a node of each is built and started.

use std::path::PathBuf;
use std::process::Command;

use crate::{process, python, workspace};

/// The file of objects for a stack that takes those that it is given.
const COMMON: Sheet = Sheet { source: "", path: "tests/peers/stacks/stack.eds", changes: &[] };
const COMPLETE: Sheet = Sheet { source: "", path: "tests/peers/stacks/complete.eds", changes: &[] };

const WITH_LSS: (&str, &str) = ("LSS_Supported=0", "LSS_Supported=1");

/// A stack of other people.
pub(super) struct Stack {
    pub(super) name: &'static str,
    pub(super) eds: Sheet,
    program: Program,
}

/// The EDS of a stack's node.
pub(super) struct Sheet {
    /// The unpacked source that has it; of this repository if empty.
    source: &'static str,
    path: &'static str,
    /// What differs from the file.
    changes: &'static [(&'static str, &'static str)],
}

/// What runs it: `PROGRAM HOST PORT NODE FILE.eds` prints `running` when it does.
enum Program {
    /// A script, in an environment with these requirements.
    Python { requirements: &'static str, script: &'static str },
    /// A binary of the package `tests/peers/stacks/rust`, which is outside of the workspace.
    Rust { binary: &'static str },
    /// An adapter in `tests/peers/stacks/c`, compiled together with sources that are unpacked in `target/sources`.
    C(Sources),
}

/// Sources of a stack in C.
struct Sources {
    folder: &'static str,
    repository: &'static str,
    commit: &'static str,
    /// Of ours, in `tests/peers/stacks/c`; the program has the name of the last.
    adapter: &'static [&'static str],
    defines: &'static [&'static str],
    includes: &'static [&'static str],
    /// Files, and folders of files.
    files: &'static [&'static str],
}

pub(super) const STACKS: &[Stack] = &[
    Stack {
        name: "canopen-python 2.4.1, `LocalNode`",
        eds: COMMON,
        program: Program::Python {
            requirements: "tests/peers/requirements.txt",
            script: "tests/peers/stacks/canopen_python.py",
        },
    },
    Stack {
        name: "zencan-node 0.0.5",
        eds: Sheet { source: "", path: "tests/peers/stacks/rust/zencan.eds", changes: &[] },
        program: Program::Rust { binary: "zencan_stack" },
    },
    Stack {
        name: "canopen-rs 0.6.1",
        eds: Sheet { source: "", path: "tests/peers/stacks/stack.eds", changes: &[WITH_LSS] },
        program: Program::Rust { binary: "canopen_rs_stack" },
    },
    Stack {
        name: "CANopenNode 4.1 (`9b8beed`)",
        eds: Sheet { source: "CANopenNode", path: "example/DS301_profile.eds", changes: &[] },
        program: Program::C(Sources {
            folder: "CANopenNode",
            repository: "https://github.com/CANopenNode/CANopenNode",
            commit: "9b8beed8367241e96ac03f916cd5a500bcb2cf23",
            adapter: &["hub.c", "canopennode.c"],
            defines: &[],
            includes: &["", "example"],
            files: &[
                "CANopen.c",
                "301",
                "303",
                "304",
                "305",
                "309",
                "storage/CO_storage.c",
                "example/OD.c",
                "example/CO_storageBlank.c",
            ],
        }),
    },
    Stack {
        name: "canopen-stack 4.4.0",
        eds: Sheet {
            source: "",
            path: "tests/peers/stacks/stack.eds",
            changes: &[
                WITH_LSS,
                // It has no remote frames, which bit 30 says, and without 1005h it hears no SYNC.
                ("$NODEID+0x180", "$NODEID+0x40000180"),
                ("SupportedObjects=7\n1=0x1008\n", "SupportedObjects=8\n8=0x1005\n1=0x1008\n"),
                ("[1008]\n", COB_ID_SYNC),
            ],
        },
        program: Program::C(Sources {
            folder: "canopen-stack",
            repository: "https://github.com/embedded-office/canopen-stack",
            commit: "f4e4db8b7792dc176f08c8d8fd9f2a3f6ac99621",
            adapter: &["hub.c", "canopen_stack.c"],
            defines: &[],
            includes: CANOPEN_STACK,
            files: CANOPEN_STACK,
        }),
    },
    Stack { name: "Lely core 2.3 (`620d185`)", eds: COMPLETE, program: Program::C(LELY) },
];

const LELY: Sources = Sources {
    folder: "lely-core",
    repository: "https://gitlab.com/lely_industries/lely-core",
    commit: "620d1858eb8520dbc3dc5e1a7314565becd54199",
    adapter: &["hub.c", "lely.c"],
    defines: &["NDEBUG", "LELY_NO_CXX=1", "LELY_NO_CO_GW=1", "LELY_NO_CO_GW_TXT=1", "_GNU_SOURCE"],
    includes: &["include"],
    files: &["src/co", "src/can", "src/util", "src/libc"],
};

/// An object before that of the device's name.
const COB_ID_SYNC: &str = "[1005]\nParameterName=COB-ID SYNC\nObjectType=0x7\nDataType=0x7\nAccessType=rw\n\
                           DefaultValue=0x80\nPDOMapping=0\n\n[1008]\n";

const CANOPEN_STACK: &[&str] = &[
    "src/config",
    "src/core",
    "src/hal",
    "src/object/basic",
    "src/object/cia301",
    "src/service/cia301",
    "src/service/cia305",
];

impl Stack {
    /// Why it cannot be built here: its sources are not in `target/sources`.
    pub(super) fn missing(&self) -> Option<String> {
        if let Program::C(sources) = &self.program { sources.missing() } else { None }
    }

    /// Builds it, and returns how it is started, without the arguments.
    pub(super) fn command(&self) -> Result<Command, String> {
        let root = workspace::root();
        Ok(match &self.program {
            Program::Python { requirements, script } => {
                let mut command = Command::new(python::environment("peers-venv", requirements)?);
                command.arg(root.join(script));
                command
            }
            Program::Rust { binary } => Command::new(rust_program(binary, "dev")?),
            Program::C(sources) => Command::new(sources.compiled()?),
        })
    }
}

/// A binary of the package of stacks in Rust.
pub(crate) fn rust_program(binary: &str, profile: &str) -> Result<PathBuf, String> {
    let mut build = workspace::cargo();
    build.args(["build", "--quiet", "--profile", profile, "--bin", binary]);
    let target = workspace::target().join("stacks");
    build.current_dir(workspace::root().join("tests/peers/stacks/rust")).env("CARGO_TARGET_DIR", &target);
    process::quietly(&mut build)?;
    let folder = if profile == "dev" { "debug" } else { profile };
    Ok(target.join(folder).join(format!("{binary}{}", std::env::consts::EXE_SUFFIX)))
}

fn source(folder: &str) -> PathBuf {
    workspace::target().join("sources").join(folder)
}

impl Sheet {
    /// The file for this stack, with what differs.
    pub(super) fn file(&self, stack: &str) -> Result<PathBuf, String> {
        let folder = if self.source.is_empty() { workspace::root() } else { source(self.source) };
        let path = folder.join(self.path);
        if self.changes.is_empty() {
            return Ok(path);
        }
        let text = std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        let mut changed = text.replace("\r\n", "\n");
        for (from, to) in self.changes {
            if !changed.contains(from) {
                return Err(format!("{}: {from:?} is not in it", path.display()));
            }
            changed = changed.replace(from, to);
        }
        let name = stack.split(' ').next().unwrap_or(stack);
        let written = workspace::target().join("stacks").join(format!("{name}.eds"));
        std::fs::create_dir_all(workspace::target().join("stacks")).map_err(|error| error.to_string())?;
        std::fs::write(&written, changed).map_err(|error| format!("{}: {error}", written.display()))?;
        Ok(written)
    }
}

/// Both sides of a transfer in blocks of Lely core.
pub(crate) fn compiled_blocks() -> Result<PathBuf, String> {
    let sources = Sources { adapter: &["lely_blocks.c"], ..LELY };
    sources.missing().map_or_else(|| sources.compiled(), Err)
}

impl Sources {
    /// What to do where they are not there.
    fn missing(&self) -> Option<String> {
        let Self { folder, repository, commit, .. } = self;
        let place = source(folder);
        let shown = place.display();
        let recipe = format!("git clone {repository} {shown} && git -C {shown} checkout {commit}");
        (!place.is_dir()).then(|| format!("not run, since {shown} is missing: {recipe}"))
    }

    /// Compiles the stack with its adapter.
    fn compiled(&self) -> Result<PathBuf, String> {
        let adapters = workspace::root().join("tests/peers/stacks/c");
        let target = workspace::target().join("stacks");
        std::fs::create_dir_all(&target).map_err(|error| error.to_string())?;
        let program = target.join(self.adapter.last().unwrap_or(&self.folder).trim_end_matches(".c"));
        let mut compiler = Command::new("cc");
        // Warnings are their makers' to see.
        compiler.args(["-O2", "-w"]).args(self.defines.iter().map(|define| format!("-D{define}")));
        compiler.arg("-I").arg(&adapters);
        for include in self.includes {
            compiler.arg("-I").arg(source(self.folder).join(include));
        }
        for place in self.files {
            compiler.args(files(&source(self.folder).join(place))?);
        }
        compiler.args(self.adapter.iter().map(|file| adapters.join(file))).arg("-o").arg(&program);
        process::quietly(compiler.args(["-lm", "-lpthread"]))?;
        Ok(program)
    }
}

/// A file, or the C files of a folder.
fn files(place: &std::path::Path) -> Result<Vec<PathBuf>, String> {
    if place.is_file() {
        return Ok(vec![place.to_path_buf()]);
    }
    let entries = std::fs::read_dir(place).map_err(|error| format!("{}: {error}", place.display()))?;
    let mut files: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.retain(|file| file.extension().is_some_and(|extension| extension == "c"));
    files.sort();
    Ok(files)
}
