//! Runs a child process to its end, line by line.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

/// Runs `command`, hands each line of its standard output to `on_line` as it comes, and returns whether it ended well.
/// Standard error goes straight to ours. There is no standard input.
pub(crate) fn run(command: &mut Command, mut on_line: impl FnMut(&str)) -> Result<bool, String> {
    let program = command.get_program().to_string_lossy().into_owned();
    let failed = |error: std::io::Error| format!("cannot run {program}: {error}");
    let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().map_err(failed)?;
    if let Some(output) = child.stdout.take() {
        for line in BufReader::new(output).split(b'\n') {
            let line = line.map_err(failed)?;
            on_line(String::from_utf8_lossy(&line).trim_end_matches('\r'));
        }
    }
    Ok(child.wait().map_err(failed)?.success())
}

/// Whether `program args` runs and ends well, with all its output thrown away.
pub(crate) fn works(program: &str, args: &[&str]) -> bool {
    let quiet =
        Command::new(program).args(args).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status();
    quiet.is_ok_and(|status| status.success())
}

/// The standard output of `command`, or what went wrong.
pub(crate) fn output(command: &mut Command) -> Result<String, String> {
    let program = command.get_program().to_string_lossy().into_owned();
    let output = command.stdin(Stdio::null()).output().map_err(|error| format!("cannot run {program}: {error}"))?;
    if !output.status.success() {
        return Err(format!("{program} failed: {}", String::from_utf8_lossy(&output.stderr).trim()));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Runs a program and discards its output; its name and the end of its output when it fails.
pub(crate) fn quietly(command: &mut Command) -> Result<(), String> {
    output(command).map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_arrive_in_order_and_the_ending_is_reported() {
        let mut lines = Vec::new();
        let ok = run(Command::new("cargo").arg("--version"), |line| lines.push(line.to_owned()));
        assert_eq!(ok, Ok(true));
        assert!(lines[0].starts_with("cargo "), "{lines:?}");
    }

    #[test]
    fn a_program_that_is_missing_is_named() {
        let error = run(&mut Command::new("no-such-program-here"), |_| ()).unwrap_err();
        assert!(error.contains("no-such-program-here"), "{error}");
    }
}
