//! The core crates on a microcontroller: they build for a Cortex-M4F, and what two programs of them take of flash and RAM.
//!
//! Where the target comes from: [`Rust`].

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use crate::process::quietly;
use crate::say::say;
use crate::sysroot::{Rust, Target};
use crate::tally::Tally;
use crate::{tidy, workspace};

/// A microcontroller with a floating-point unit and no operating system.
const TARGET: Target = Target {
    name: "thumbv7em-none-eabihf",
    crates: "core",
    features: "compiler-builtins-mem",
    opt_level: "\"s\"",
    panic: "abort",
};

/// The programs of `benches/bare_metal`: where each begins, and what it is.
const PROGRAMS: [(&str, &str); 2] =
    [("node_main", "a node with 30 objects"), ("zlac8030l_main", "the whole ZLAC8030L")];

/// The core crates compile.
pub(crate) fn step() -> Tally {
    with_rust(|rust| {
        let packages = tidy::NO_STD.iter().flat_map(|name| ["--package".to_owned(), format!("ferrodrive-{name}")]);
        quietly(rust.cargo(&["check"]).args(packages))
    })
}

/// Links both programs and says what each takes.
pub(crate) fn sizes_step() -> Tally {
    with_rust(|rust| sizes(rust).map(|lines| lines.iter().for_each(say)))
}

/// What the steps take of others.
pub(crate) fn fetch() -> Result<(), String> {
    rust().map(|_| ())
}

fn with_rust(run: impl Fn(&Rust) -> Result<(), String>) -> Tally {
    match rust() {
        Ok(rust) => run(rust).map_or_else(Tally::failed, |()| Tally::passed()),
        Err(reason) => Tally::skipped(reason),
    }
}

/// Looked for once in a run: where it cannot be had, that takes a while.
fn rust() -> Result<&'static Rust, String> {
    static FOUND: OnceLock<Result<Rust, String>> = OnceLock::new();
    FOUND.get_or_init(|| Rust::found(TARGET, &folder())).as_ref().map_err(Clone::clone)
}

fn sizes(rust: &Rust) -> Result<Vec<String>, String> {
    let words = ["rustc", "--profile", "flash", "--package", "ferrodrive-bare-metal", "--crate-type", "staticlib"];
    quietly(&mut rust.cargo(&words))?;
    let library = rust.built("flash").join("libbare_metal.a");
    PROGRAMS.iter().map(|(entry, what)| size(rust, &library, entry).map(|size| format!("{what}: {size}"))).collect()
}

fn size(rust: &Rust, library: &Path, entry: &str) -> Result<String, String> {
    let image = folder().join(entry);
    let mut linker = Command::new(rust.programs.join("rust-lld"));
    // What is missing are the board's own functions, which are nobody's here.
    linker.args(["-flavor", "gnu", "--gc-sections", "--unresolved-symbols=ignore-all", "-e", entry, "-u", entry]);
    quietly(linker.arg(library).arg("-o").arg(&image))?;
    let bytes = std::fs::read(&image).map_err(|error| format!("{}: {error}", image.display()))?;
    let size = Size::of(&bytes).ok_or_else(|| format!("{} is not an ELF image of 32 bits", image.display()))?;
    Ok(format!("{} bytes of flash, {} bytes of RAM beside its stack", size.flash, size.ram))
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

/// What is made here, by this step alone.
fn folder() -> PathBuf {
    workspace::target().join("bare_metal")
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
