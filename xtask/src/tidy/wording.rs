//! Habits of wording at which an English-speaking reader stumbles. A habit is a row of words, also over the line breaks
//! of comments and strings. Names in snake case count as one word.

use super::finding::Finding;
use super::text::THE_RULES;

/// Files with sentences that people read.
const READ: &[&str] = &[".rs", ".md", ".py", ".js", ".html"];

struct Habit {
    phrases: &'static [&'static str],
    /// True where the phrase is good English, by the word before it and the two after it.
    is_fine: fn(&str, &str, &str) -> bool,
    why: &'static str,
    remedy: &'static str,
}

const NEVER_FINE: fn(&str, &str, &str) -> bool = |_, _, _| false;

const HABITS: &[Habit] = &[
    Habit {
        phrases: &["is no"],
        // "there is no", "is no longer", "is no more than", "is no less urgent", "is no larger than".
        is_fine: |before, after, further| {
            before == "there" || ["longer", "more", "less"].contains(&after) || further == "than"
        },
        why: "it reads as a translation",
        remedy: "write \"is not a ...\"",
    },
    Habit {
        phrases: &["leave away", "leaves away", "left away", "leave it away", "leave them away"],
        is_fine: NEVER_FINE,
        why: "it is not English",
        remedy: "write \"leave out\" or \"omit\"",
    },
    Habit {
        phrases: &["upper computer"],
        is_fine: NEVER_FINE,
        why: "no reader knows it",
        remedy: "write \"host\", \"master\" or \"web front end\"",
    },
    Habit {
        phrases: &["told"],
        is_fine: NEVER_FINE,
        why: "programs and drives do not talk, and what happens stays open",
        remedy: "write \"is reported\", \"is shown\", \"is sent\", \"is commanded\" or \"is given\"",
    },
    Habit {
        phrases: &["whoever", "nobody", "somebody"],
        is_fine: NEVER_FINE,
        why: "it leaves open which program, device or person is meant",
        remedy: "name it (the caller, another master, no node), or use the passive",
    },
    Habit {
        // `None` of Rust and Python is a name.
        phrases: &["is none", "are none"],
        is_fine: |before, _, _| before == "there",
        why: "it reads as a translation",
        remedy: "write \"is not ...\", \"is invalid\", \"has no effect\" or \"is zero\"",
    },
    Habit {
        phrases: &["are no"],
        // As of "is no".
        is_fine: |before, after, further| {
            before == "there" || ["longer", "more", "less"].contains(&after) || further == "than"
        },
        why: "it reads as a translation",
        remedy: "write \"are not\"",
    },
    Habit {
        phrases: &["anybody", "everybody", "anybody's", "everybody's"],
        is_fine: NEVER_FINE,
        why: "it leaves open which program, device or person is meant",
        remedy: "name it (every node, each client, another program), or use the passive",
    },
    Habit {
        phrases: &["says so"],
        is_fine: NEVER_FINE,
        why: "it leaves open where and in what form",
        remedy: "write \"reports it\", or name the field that has it",
    },
];

/// Banned habits in the texts of the whole tree.
pub(super) fn habits(path: &str, text: &str) -> Vec<Finding> {
    if !READ.iter().any(|ending| path.ends_with(ending)) || path.starts_with(THE_RULES) {
        return Vec::new();
    }
    let words = words(text);
    let mut found = Vec::new();
    for at in 0..words.len() {
        for habit in HABITS {
            found.extend(habit.phrases.iter().filter_map(|phrase| finding(path, habit, phrase, &words, at)));
        }
    }
    found
}

fn finding(path: &str, habit: &Habit, phrase: &str, words: &[Word], at: usize) -> Option<Finding> {
    // Most words begin no phrase.
    let rest = phrase.strip_prefix(&*words[at].text)?;
    if !rest.is_empty() && !rest.starts_with(' ') {
        return None;
    }
    let length = phrase.split(' ').count();
    let here = words.get(at..at + length)?;
    let same = phrase.split(' ').zip(here).all(|(wanted, word)| word.text == wanted);
    let is_name = length == 1 && here[0].is_quoted;
    let in_a_row = here[1..].iter().all(|word| word.follows);
    let after = |skip: usize| {
        let row = words.get(at + length..=at + length + skip)?;
        row.iter().all(|word| word.follows).then(|| row[skip].text.as_str())
    };
    let before = at.checked_sub(1).filter(|_| here[0].follows).map_or("", |before| words[before].text.as_str());
    if !same || is_name || !in_a_row || (habit.is_fine)(before, after(0).unwrap_or(""), after(1).unwrap_or("")) {
        return None;
    }
    let Habit { why, remedy, .. } = *habit;
    Some(Finding {
        path: path.to_owned(),
        line: here[0].line,
        rule: "wording",
        what: format!("\"{phrase}\""),
        why,
        remedy,
    })
}

struct Word {
    /// In small letters, but for the name `None`.
    text: String,
    line: usize,
    /// Nothing but blanks, and the marks of comments and of a string's broken line, is between it and the word before.
    follows: bool,
    /// Alone between quotation marks or backticks: a name, such as a kind of error, and not a part of a sentence.
    is_quoted: bool,
}

fn words(text: &str) -> Vec<Word> {
    let mut words: Vec<Word> = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let mut gap = line;
        let mut is_first = true;
        while let Some(begin) = gap.find(is_of_a_word) {
            let rest = &gap[begin..];
            let end = rest.find(|letter| !is_of_a_word(letter)).unwrap_or(rest.len());
            let between =
                if is_first { gap[..begin].trim_start_matches([' ', '/', '!', '*', '#']) } else { &gap[..begin] };
            words.push(Word {
                text: if &rest[..end] == "None" { "None".to_owned() } else { rest[..end].to_lowercase() },
                line: number + 1,
                follows: !words.is_empty() && between.trim().is_empty(),
                is_quoted: gap[..begin].ends_with(['"', '`']) && rest[end..].starts_with(['"', '`']),
            });
            gap = &rest[end..];
            is_first = false;
        }
        // What ends a line stands between its last word and the first of the next one.
        if !gap.trim_end_matches('\\').trim().is_empty() {
            words.push(Word { text: String::new(), line: number + 1, follows: false, is_quoted: false });
        }
    }
    words
}

fn is_of_a_word(letter: char) -> bool {
    letter.is_alphanumeric() || letter == '_' || letter == '\''
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATH: &str = "crates/master/src/a.rs";

    fn found(text: &str) -> Vec<(usize, String)> {
        habits(PATH, text).into_iter().map(|finding| (finding.line, finding.what)).collect()
    }

    #[test]
    fn every_phrase_is_found_with_its_line_in_any_case() {
        for habit in HABITS {
            for phrase in habit.phrases {
                for text in [format!("/// x\n/// An axis, {phrase} y.\n"), format!("\n\"A {}\"", phrase.to_uppercase())]
                {
                    let found = habits(PATH, &text);
                    assert_eq!(found.iter().map(|finding| finding.line).collect::<Vec<_>>(), [2], "{text}");
                    assert_eq!((&*found[0].what, found[0].remedy), (&*format!("\"{phrase}\""), habit.remedy));
                }
            }
        }
    }

    #[test]
    fn a_phrase_is_found_over_the_line_breaks_of_comments_and_strings() {
        for text in [
            "//! it is\n//! no drive\n",
            "    // it is\n    // no drive\n",
            "\"it is \\\n   no drive\"",
            "It is\nno drive.",
        ] {
            assert_eq!(found(text), [(1, "\"is no\"".to_owned())], "{text}");
        }
    }

    #[test]
    fn good_english_is_left_alone() {
        for text in [
            "There is no drive.",
            "// there\n// is no drive",
            "it is no longer known",
            "it is\nno longer known",
            "that is no more than a guess",
            "it is no less urgent",
            "it is no larger than before",
            "That is it. No drive answers.",
            "as it is: no drive answers",
            "let is = no;",
            "model.fault_reported_by(code)",
            "he_told",
            "foretold",
            "if there is none, there are none",
            "if value is None: return",
            "there are no drives",
            "they are no longer sent, and are no larger than before",
            ".of_kind(\"everybody\")",
            "leave out, go away",
            ".of_kind(\"nobody\")",
            "| `no_answer`, `nobody` |",
        ] {
            assert_eq!(found(text), [], "{text}");
        }
    }

    #[test]
    fn a_name_before_the_phrase_does_not_excuse_it() {
        assert_eq!(found("there: it is no drive"), [(1, "\"is no\"".to_owned())]);
        assert_eq!(found("go there. Is no drive"), [(1, "\"is no\"".to_owned())]);
    }

    #[test]
    fn data_and_the_rules_are_left_alone() {
        assert_eq!(habits("crates/master/data.csv", "nobody told"), []);
        assert_eq!(habits("xtask/src/tidy/text.rs", "the upper computer"), []);
        assert_eq!(habits("LICENSE", "the upper computer"), []);
        assert_eq!(habits("crates/absent/src/a.rs", "the upper computer").len(), 1);
    }
}
