//! What is released for another architecture than this machine's, made by Debian's cross tools, and run by QEMU to see that it works.

use std::path::PathBuf;
use std::process::Command;

use crate::process::{self, quietly};
use crate::say::say;
use crate::sysroot::{Rust, Target};
use crate::{builder, debian, workspace};

/// An architecture for which a release can be made here.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Architecture {
    /// As Rust, archives and wheels call it.
    pub(crate) name: &'static str,
    target: Target,
    /// What the names of the tools begin with.
    prefix: &'static str,
    /// Runs its programs.
    emulator: &'static str,
    /// The tools, with the packages of Debian that they are in.
    programs: &'static [(&'static str, &'static str)],
}

const ARCHITECTURES: [Architecture; 1] = [Architecture {
    name: "aarch64",
    target: Target {
        name: "aarch64-unknown-linux-gnu",
        crates: "std,panic_unwind",
        features: "panic-unwind,backtrace",
        opt_level: "3",
        panic: "unwind",
    },
    prefix: "aarch64-linux-gnu",
    emulator: "qemu-aarch64-static",
    programs: &[
        ("aarch64-linux-gnu-gcc", "gcc-aarch64-linux-gnu libc6-dev-arm64-cross"),
        ("qemu-aarch64-static", "qemu-user-static"),
    ],
}];

/// The tools for an architecture.
pub(crate) struct Cross {
    pub(crate) architecture: Architecture,
    rust: Rust,
}

impl Cross {
    /// Those for the architecture of this name, installed if this user may.
    ///
    /// # Errors
    /// A sentence: which is missing, or why the standard library cannot be had.
    pub(crate) fn found(name: &str) -> Result<Self, String> {
        let known = || ARCHITECTURES.map(|architecture| architecture.name).join(", ");
        let architecture = ARCHITECTURES.into_iter().find(|architecture| architecture.name == name);
        let architecture = architecture.ok_or_else(|| format!("{name}: expected one of: {}", known()))?;
        debian::install(architecture.programs)?;
        let rust = Rust::found(architecture.target, &workspace::target().join(name))?;
        Ok(Self { architecture, rust })
    }

    /// Builds the binary in a profile.
    pub(crate) fn program(&self, profile: &str) -> Result<PathBuf, String> {
        say(format_args!("building the binary ({}, {profile})", self.architecture.name));
        let words = ["build", "--locked", "--profile", profile, "--package", "ferrodrive", "--bin", "ferrodrive"];
        let mut cargo = self.rust.cargo(&words);
        self.set_tools(&mut cargo);
        quietly(&mut cargo)?;
        Ok(self.rust.built(if profile == "dev" { "debug" } else { profile }).join("ferrodrive"))
    }

    /// Has a command that builds use them: cargo itself, or what starts it.
    pub(crate) fn set_tools(&self, command: &mut Command) {
        let Architecture { target, prefix, .. } = self.architecture;
        let (in_variable, gcc) = (target.name.replace('-', "_"), format!("{prefix}-gcc"));
        command.env(format!("CARGO_TARGET_{}_LINKER", in_variable.to_uppercase()), &gcc);
        command.env(format!("CC_{in_variable}"), &gcc).env(format!("AR_{in_variable}"), format!("{prefix}-ar"));
        self.rust.set_sysroot(command);
        builder::leave_out(command);
    }

    /// The target, as `--target` takes it.
    pub(crate) const fn target(&self) -> &'static str {
        self.architecture.target.name
    }

    /// Removes the symbols of a binary.
    pub(crate) fn strip(&self, binary: &str) -> bool {
        process::works(&format!("{}-strip", self.architecture.prefix), &[binary])
    }

    /// A command that runs a program of the architecture, to which words can be added.
    pub(crate) fn run(&self, program: &std::path::Path) -> Command {
        let mut command = Command::new(self.architecture.emulator);
        command.args(["-L", &format!("/usr/{}", self.architecture.prefix)]).arg(program);
        command
    }
}
