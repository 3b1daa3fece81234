//! Plays the conversations of `tests/conversations` with virtual drives, line by line, and holds the procedures of `ferrodrive
//! demo` against the datagrams that the manuals print.

use std::collections::BTreeSet;
use std::path::Path;

use ferrodrive_tests::{mjoint, zlac8030l, zlim42c};

/// Each with its name and its text.
fn conversations() -> Vec<(String, String)> {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("conversations");
    let mut files: Vec<_> = std::fs::read_dir(&directory)
        .expect("the conversations")
        .flat_map(|model| model.expect("an entry").path().read_dir().into_iter().flatten())
        .map(|file| file.expect("a file").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "can"))
        .collect();
    files.sort();
    let name = |path: &Path| path.strip_prefix(&directory).unwrap_or(path).display().to_string();
    files.iter().map(|path| (name(path), std::fs::read_to_string(path).expect("a text"))).collect()
}

#[test]
fn every_conversation_goes_as_it_is_written() {
    let conversations = conversations();
    assert!(conversations.len() >= 13, "{} conversations", conversations.len());
    let differs = |(name, text): &(String, String)| showcase::converse(name, text).err().map(|error| error.to_string());
    let different: Vec<_> = conversations.iter().filter_map(differs).collect();
    assert!(different.is_empty(), "\n{}", different.join("\n"));
}

fn reported(text: &str) -> String {
    showcase::converse("x.can", text).expect_err("a difference").to_string()
}

#[test]
fn a_line_that_differs_is_shown_with_its_neighbours_and_what_came_instead() {
    let text =
        "# Device type.\ndrive zlac8030l 4\n> 604#4000100000000000\n< 584#4300100092010200  another type\n# end\n";
    let expected = [
        "x.can:4: heard 584#4300100092010400",
        "   2   drive zlac8030l 4",
        "   3   > 604#4000100000000000",
        "   4 * < 584#4300100092010200  another type",
        "   5   # end",
    ];
    assert_eq!(reported(text).lines().collect::<Vec<_>>(), expected);
}

#[test]
fn silence_and_surplus_are_differences_too() {
    let reported = |lines: &str| reported(&format!("drive zlac8030l 4\n{lines}"));
    assert!(reported("< 704#00\n").starts_with("x.can:2: heard nothing"));
    assert!(reported("> 604#4000100000000000\n+ 5 ms\n+ 5 ms\n").starts_with("x.can:4: unexpected 584#"));
    assert!(reported("> 604#4000100000000000\n+ 5 ms\n").starts_with("x.can:3: unexpected 584#"));
    assert!(reported("> 604#4000100000000000\n< 584#43001000........  1..2\n").starts_with("x.can:3: heard 262546"));
    assert!(reported("hello\n").starts_with("x.can:2: "));
}

#[test]
fn a_header_names_a_drive_that_is_there() {
    for header in ["", "drive", "drive zlac8031l 4", "drive zlac8030l 5", "> 604#40"] {
        assert!(showcase::converse("x.can", header).is_err(), "{header}");
    }
}

#[test]
fn every_request_that_a_manual_prints_is_made() {
    let showcase = showcase::run(None, |_| {}).expect("it runs");
    let of_procedures = showcase.parts.iter().flat_map(|part| &part.rows).map(|row| row.asked.clone());
    let of_conversations = conversations().into_iter().flat_map(|(_, text)| {
        let sent = text.lines().filter_map(|line| line.strip_prefix("> "));
        sent.filter_map(|line| Some(line.split_whitespace().next()?.to_owned())).collect::<Vec<_>>()
    });
    let made: BTreeSet<_> = of_procedures.chain(of_conversations).collect();
    let manuals = [zlac8030l::datagrams(), mjoint::datagrams(), zlim42c::datagrams()];
    let requests = manuals.iter().flatten().filter_map(|datagram| Some((datagram, datagram.request.as_ref()?)));
    let written = requests.map(|(datagram, (id, data))| {
        let bytes: String = data.iter().map(|byte| format!("{byte:02X}")).collect();
        (datagram, format!("{id:03X}#{bytes}"), bytes)
    });
    // The table shows what is said to an SDO server without its identifier.
    let missing = written.filter(|(_, frame, bytes)| !made.contains(frame) && !made.contains(bytes));
    let missing: Vec<_> = missing.map(|(datagram, frame, _)| format!("{}: {frame}", datagram.section)).collect();
    assert!(missing.is_empty(), "{missing:#?}");
}
