//! Advice that names a command of the command line, in the words of a Python program: what both front ends advise is written once, and
//! a command that the Python package has too is named by its call.

use std::borrow::Cow;

/// The program's name, as advice has it before a command.
const PROGRAM: &str = "ferrodrive ";

/// A text with the calls in place of the commands. A command that Python does not have stays as it is.
pub fn in_python(text: &str) -> Cow<'_, str> {
    if !text.contains(PROGRAM) {
        return Cow::Borrowed(text);
    }
    let mut said = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find(PROGRAM) {
        let (before, found) = rest.split_at(at);
        said.push_str(before);
        // A path or a name that ends so is not the program.
        let begins = !before.ends_with(|c: char| c.is_alphanumeric() || "/._-".contains(c));
        match begins.then(|| call(&found[PROGRAM.len()..])).flatten() {
            Some((call, left)) => {
                said.push_str(&call);
                rest = left;
            }
            None => {
                said.push_str(PROGRAM);
                rest = &found[PROGRAM.len()..];
            }
        }
    }
    said.push_str(rest);
    Cow::Owned(said)
}

/// What follows the program's name, word by word; a word that ends a phrase is the last.
struct Words<'a> {
    rest: &'a str,
}

impl<'a> Words<'a> {
    /// The next word, if the phrase goes on and the word is one of these.
    fn take(&mut self, wanted: impl FnOnce(&str) -> bool) -> Option<&'a str> {
        let after = self.rest.strip_prefix(' ')?;
        let end = after.find(|c: char| c.is_whitespace() || "`,;)".contains(c)).unwrap_or(after.len());
        let word = after[..end].trim_end_matches(['.', ':']);
        if word.is_empty() || !wanted(word) {
            return None;
        }
        self.rest = &after[word.len()..];
        Some(word)
    }

    fn node(&mut self) -> &'a str {
        self.take(|word| word == "NODE" || word.parse::<u8>().is_ok()).unwrap_or("NODE")
    }

    /// The value of an option.
    fn option(&mut self, name: &str) -> Option<&'a str> {
        self.take(|word| word == name).and_then(|_| self.take(|_| true))
    }

    /// A path, which ends the text.
    fn path(&mut self) -> Option<String> {
        if let Some(placeholder) = self.take(|word| word == "FILE") {
            return Some(format!("{placeholder:?}"));
        }
        let path = self.rest.strip_prefix(' ')?;
        self.rest = "";
        Some(format!("{path:?}"))
    }
}

/// The call that does what a command does, and what follows it in the text.
fn call(text: &str) -> Option<(String, &str)> {
    let end = text.find(|c: char| !c.is_ascii_lowercase() && c != '-').unwrap_or(text.len());
    let (command, rest) = text.split_at(end);
    let mut words = Words { rest };
    let call = match command {
        "scan" => "network.scan()".to_owned(),
        "explain" => format!("network.explain({})", words.node()),
        "plan" => match words.option("--cycle").and_then(seconds) {
            Some(cycle) => format!("network.plan(cycle={cycle})"),
            None => "network.plan()".to_owned(),
        },
        "boot" => {
            words.take(|word| word == "FILE");
            let reset = words.take(|word| word == "--reset").map_or("", |_| "reset=True");
            format!("network.boot({reset})")
        }
        "enable" | "disable" | "stop" | "save" => format!("network.drive({}).{command}()", words.node()),
        "reset" => format!("network.drive({}).reset_fault()", words.node()),
        "move" => format!("network.drive({}).move(..)", words.node()),
        "home" => {
            let node = words.node();
            format!("network.drive({node}).home({})", words.option("--method")?)
        }
        "nmt" => {
            let node = words.take(|word| word.parse::<u8>().is_ok());
            let command = words.take(|_| true)?;
            format!("network.nmt({command:?}{})", node.map(|node| format!(", {node}")).unwrap_or_default())
        }
        "sync" => format!("network.sync({})", seconds(words.option("--every")?)?),
        "read" => {
            let (node, object) = (words.node(), words.take(|_| true)?);
            // Of a name, of several objects or of a range there is no such call.
            let (index, sub_index) = object.split_once(':').unwrap_or((object, "0"));
            let number = |text| u16::from_str_radix(text, 16).ok();
            let (index, sub_index) = number(index).zip(number(sub_index))?;
            if words.take(|_| true).is_some() {
                return None;
            }
            format!("network.upload({node}, 0x{index:04X}, {sub_index})")
        }
        "params" => parameters(&mut words)?,
        "check" => format!("ferrodrive.check({:?})", words.take(|_| true)?),
        "eds" => format!("ferrodrive.eds({:?})", words.take(|word| word == "MODEL")?),
        "run" => format!("ferrodrive.run({:?}, ..)", words.take(|_| true)?),
        _ => return None,
    };
    Some((call, words.rest))
}

fn parameters(words: &mut Words<'_>) -> Option<String> {
    let command = words.take(|word| matches!(word, "apply" | "backup" | "rollback"))?;
    let node = words.node();
    if command == "backup" {
        let file = words.option("-o").map(|file| format!("{file:?}")).unwrap_or_default();
        return Some(format!("network.params({node}).backup({file})"));
    }
    Some(format!("network.params({node}).{command}({})", words.path().unwrap_or_default()))
}

/// A time of the command line in s.
fn seconds(time: &str) -> Option<f64> {
    master::units::parse_duration(time).ok().map(|time| time.as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::in_python;

    #[test]
    fn a_command_that_python_has_is_named_by_its_call() {
        for (said, wanted) in [
            ("ferrodrive scan shows more", "network.scan() shows more"),
            (
                "Check it: ferrodrive scan, ferrodrive read NODE 1000 1018:*",
                "Check it: network.scan(), ferrodrive read NODE 1000 1018:*",
            ),
            ("its identity: ferrodrive read 4 1018:01", "its identity: network.upload(4, 0x1018, 1)"),
            (
                "ferrodrive params apply NODE FILE, or boot by a machine file",
                "network.params(NODE).apply(\"FILE\"), or boot by a machine file",
            ),
            ("`ferrodrive explain 4` says it", "`network.explain(4)` says it"),
            ("ferrodrive explain says what the drive shows", "network.explain(NODE) says what the drive shows"),
            ("ferrodrive plan --cycle 500us shows each frame", "network.plan(cycle=0.0005) shows each frame"),
            ("Then: ferrodrive reset 4", "Then: network.drive(4).reset_fault()"),
            ("until ferrodrive disable 4", "until network.drive(4).disable()"),
            ("Start it: ferrodrive nmt 4 start", "Start it: network.nmt(\"start\", 4)"),
            ("(ferrodrive nmt reset-communication), or", "(network.nmt(\"reset-communication\")), or"),
            ("SYNC (ferrodrive sync --every 10ms), or", "SYNC (network.sync(0.01)), or"),
            ("or: ferrodrive home 4 --method N", "or: network.drive(4).home(N)"),
            (
                "to have it now: ferrodrive params apply, or ferrodrive boot",
                "to have it now: network.params(NODE).apply(), or network.boot()",
            ),
            ("boot it with `ferrodrive boot FILE --reset`, which", "boot it with `network.boot(reset=True)`, which"),
            (
                "go back: ferrodrive params rollback 4 /tmp/a b.journal",
                "go back: network.params(4).rollback(\"/tmp/a b.journal\")",
            ),
            (
                "make one: ferrodrive params backup NODE -o FILE.toml",
                "make one: network.params(NODE).backup(\"FILE.toml\")",
            ),
            ("`ferrodrive eds MODEL` writes it", "`ferrodrive.eds(\"MODEL\")` writes it"),
        ] {
            assert_eq!(in_python(said), wanted);
        }
    }

    #[test]
    fn what_python_does_not_have_and_what_is_not_a_command_stays() {
        for text in [
            "Switch one off: ferrodrive lss scan, or its switches",
            "look with commands that only listen: ferrodrive dump",
            "ferrodrive eds lint FILE checks a data sheet",
            "/srv/ferrodrive scan",
            "what moves it with ferrodrive does so by itself",
            "ferrodrive ",
        ] {
            assert_eq!(in_python(text), text);
        }
    }
}
