//! The rules of `lint`: each has a file that breaks it and no other rule, and a section of the page.

use eds::{Eds, Explanation, Rule};

/// A sheet that has the right lines of every rule's example.
const RIGHT: &str = include_str!("right.dcf");
const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/eds_rules.md");

fn found(text: &str) -> Vec<&'static str> {
    Eds::load(text.as_bytes()).unwrap().findings.iter().map(|finding| finding.rule.id()).collect()
}

/// The right sheet with the lines of one example wrong.
fn wrong(rule: &Explanation) -> String {
    let [wrong, right] = [rule.wrong, rule.right].map(|lines| lines.split("\n...\n").collect::<Vec<_>>());
    assert_eq!(wrong.len(), right.len(), "{}", rule.id);
    right.iter().zip(wrong).fold(RIGHT.to_owned(), |text, (right, wrong)| {
        let lines = format!("\n{right}\n");
        assert_eq!(text.matches(&lines).count(), 1, "{}: {right:?} stands once in the sheet", rule.id);
        text.replace(&lines, &format!("\n{wrong}\n"))
    })
}

#[test]
fn the_wrong_lines_of_a_rule_break_it_and_no_other_and_the_right_ones_none() {
    assert_eq!(found(RIGHT), [""; 0]);
    for rule in Rule::ALL.iter().map(|rule| rule.explanation()) {
        assert_eq!(found(&wrong(rule)), [rule.id], "{}: {}", rule.id, rule.title);
    }
}

#[test]
fn numbers_ascend_and_a_rule_is_found_by_its_number() {
    assert!(Rule::ALL.windows(2).all(|pair| pair[0].id() < pair[1].id()));
    for text in ["EDS216", "eds216", "216"] {
        assert_eq!(Rule::of(text), Some(Rule::Name), "{text}");
    }
    for text in ["", "EDS", "EDS999", "E216", "16", "EDS2160", "\u{e4}\u{e4}216"] {
        assert_eq!(Rule::of(text), None, "{text}");
    }
}

#[test]
fn the_page_is_made_of_the_rules() {
    let made = page();
    if std::env::var_os("FERRODRIVE_WRITE_PAGES").is_some() {
        std::fs::write(PAGE, &made).unwrap();
    }
    let page = std::fs::read_to_string(PAGE).unwrap();
    assert_eq!(page, made, "FERRODRIVE_WRITE_PAGES=1 cargo test -p ferrodrive-eds rules writes the page anew");
}

fn page() -> String {
    let mut page = "# Rules of `eds lint`\n\n\
        What `ferrodrive eds lint` finds in [EDS and DCF files](eds.md). Each rule has a number that stays. An **error** is something \
        that had to be guessed or left out; a **warning** is readable all the same, but not as CiA 306 has it, or a trap for other \
        tools. `ferrodrive eds lint --explain EDS216` prints the section of a rule, `ferrodrive eds lint --list --json` has them all \
        for programs. This page is made of the same table, and tests hold that the wrong lines break their rule and no other, \
        and that the right ones break none.\n\n| rule | finding | | taken instead |\n|---|---|---|---|\n"
        .to_owned();
    let rules: Vec<_> = Rule::ALL.iter().map(|rule| rule.explanation()).collect();
    for rule in &rules {
        let anchor = rule.id.to_lowercase();
        page += &format!("| [{}](#{anchor}) | {} | {} | {} |\n", rule.id, rule.title, rule.severity.name(), rule.taken);
    }
    for Explanation { id, severity, title, taken, clause, why, wrong, right } in rules {
        let severity = severity.name();
        page += &format!(
            "\n## {id}\n\n**{title}** ({severity}; {clause})\n\n{why}\n\nTaken instead: {taken}.\n\n\
             Wrong:\n\n```ini\n{wrong}\n```\n\nRight:\n\n```ini\n{right}\n```\n"
        );
    }
    page
}
