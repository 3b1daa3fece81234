//! What is released does not name the folders of the machine that it was built on: rustc writes the paths of sources into the places of panics,
//! those of the registry with the home of the builder in front.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::workspace;

/// Has Cargo, or what starts it, leave these folders out of what it builds. Behind what else sets flags for this command.
pub(crate) fn leave_out(command: &mut Command) {
    let renamed = places().map(|(place, name)| format!("--remap-path-prefix={}={name}", place.display()));
    add_flags(command, &renamed);
}

/// Adds flags of rustc to those that the command, or the one who runs this program, has set.
pub(crate) fn add_flags(command: &mut Command, flags: &[String]) {
    const ENCODED: &str = "CARGO_ENCODED_RUSTFLAGS";
    let own = command.get_envs().find(|(name, _)| *name == ENCODED);
    let own = own.and_then(|(_, value)| Some(value?.to_string_lossy().into_owned()));
    let encoded = own.or_else(|| std::env::var(ENCODED).ok()).unwrap_or_else(|| {
        let plain = std::env::var("RUSTFLAGS").unwrap_or_default();
        plain.split_whitespace().collect::<Vec<_>>().join("\u{1f}")
    });
    let all = encoded.split('\u{1f}').filter(|flag| !flag.is_empty()).map(str::to_owned).chain(flags.iter().cloned());
    // As Cargo separates them: a path may have spaces.
    command.env(ENCODED, all.collect::<Vec<_>>().join("\u{1f}"));
}

/// Where a file names a folder of this machine.
///
/// # Errors
/// The file cannot be read.
pub(crate) fn named_in(file: &Path) -> Result<Option<String>, String> {
    let bytes = std::fs::read(file).map_err(|error| format!("{}: {error}", file.display()))?;
    Ok(places().into_iter().find_map(|(place, _)| {
        let place = place.to_string_lossy().into_owned();
        let at = bytes.windows(place.len()).position(|window| window == place.as_bytes())?;
        let rest = bytes[at..].iter().take(120).take_while(|byte| byte.is_ascii_graphic());
        Some(rest.map(|byte| char::from(*byte)).collect())
    }))
}

/// The folders of sources, and what stands for each. Of two that fit rustc takes the later one.
fn places() -> [(PathBuf, &'static str); 3] {
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let user = std::env::var_os("HOME").or_else(|| std::env::var_os("USERPROFILE")).map(PathBuf::from);
    let home = home.or_else(|| Some(user?.join(".cargo"))).unwrap_or_else(|| "/.cargo".into());
    [(workspace::root(), "ferrodrive"), (workspace::target(), "target"), (home, "cargo")]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_of_before_stay_and_a_path_with_a_space_is_one_flag() {
        let mut cargo = Command::new("cargo");
        cargo.env("CARGO_ENCODED_RUSTFLAGS", "--sysroot\u{1f}/a b");
        add_flags(&mut cargo, &["--remap-path-prefix=/c d=e".to_owned()]);
        let set = cargo.get_envs().find_map(|(name, value)| (name == "CARGO_ENCODED_RUSTFLAGS").then_some(value?));
        assert_eq!(set.and_then(|set| set.to_str()), Some("--sysroot\u{1f}/a b\u{1f}--remap-path-prefix=/c d=e"));
    }

    #[test]
    fn a_file_with_a_folder_of_this_machine_is_found() {
        let file = workspace::target().join(format!("tmp/named-{}", std::process::id()));
        std::fs::create_dir_all(workspace::target().join("tmp")).expect("a folder");
        let within = workspace::root().join("crates/x.rs").to_string_lossy().into_owned();
        std::fs::write(&file, format!("\0\u{7}{within}\0crates/y.rs")).expect("a file");
        assert_eq!(named_in(&file), Ok(Some(within)));
        std::fs::write(&file, "\0crates/y.rs\0cargo/registry/src/z.rs").expect("a file");
        assert_eq!(named_in(&file), Ok(None));
        std::fs::remove_file(&file).expect("to remove it");
    }
}
