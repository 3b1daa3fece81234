//! Names: words for people in a file, words to type in a description.

use std::collections::HashSet;

use crate::check::names::CUTTING;

/// Abbreviations of the field, which are written in capitals.
const CAPITALS: [&str; 12] = ["rpdo", "tpdo", "pdo", "sdo", "cob", "id", "emcy", "sync", "can", "nmt", "io", "rs485"];

/// A name as every reader of such files takes it: ASCII, on one line, without what begins a comment or a value.
pub(super) fn plain(text: &str) -> String {
    let letter = |letter: char| match letter {
        '\u{b5}' | '\u{3bc}' => "u".to_owned(),
        '\u{b0}' => "deg".to_owned(),
        '\u{b2}' => "2".to_owned(),
        '\u{b7}' => "*".to_owned(),
        letter if CUTTING.contains(&letter) || letter.is_control() => ",".to_owned(),
        letter if letter.is_ascii() => letter.to_string(),
        _ => "?".to_owned(),
    };
    text.trim().chars().map(letter).collect()
}

/// `rpdo1_parameter` as words: `RPDO1 parameter`.
pub(super) fn words(name: &str) -> String {
    let mut words: Vec<String> = name.split('_').filter(|word| !word.is_empty()).map(capitals).collect();
    if let Some(first) = words.first_mut() {
        let mut letters = first.chars();
        *first = letters.next().map(|letter| letter.to_ascii_uppercase()).into_iter().chain(letters).collect();
    }
    words.join(" ")
}

fn capitals(word: &str) -> String {
    let letters = word.trim_end_matches(|digit: char| digit.is_ascii_digit());
    if CAPITALS.contains(&letters) || CAPITALS.contains(&word) { word.to_uppercase() } else { word.to_owned() }
}

/// Numbers each name but the first of those that are the same.
pub(super) fn number_shared<'a>(names: impl Iterator<Item = &'a mut String>) {
    let names: Vec<&mut String> = names.collect();
    let mut taken: HashSet<String> = names.iter().map(|name| (**name).clone()).collect();
    let mut seen = HashSet::new();
    for name in names {
        if !seen.insert(name.clone()) {
            let numbered = (2..).map(|number| format!("{name} {number}")).find(|numbered| !taken.contains(numbered));
            *name = numbered.expect("numbers do not end");
            taken.insert(name.clone());
        }
    }
}

/// Words as a name to type: `RPDO1 parameter` is `rpdo1_parameter`.
pub(super) fn name(words: &str) -> String {
    let mut name = String::with_capacity(words.len());
    for letter in words.chars() {
        if letter.is_ascii_alphanumeric() {
            name.push(letter.to_ascii_lowercase());
        } else if !name.ends_with('_') && !name.is_empty() {
            name.push('_');
        }
    }
    let length = name.trim_end_matches('_').len();
    name.truncate(length);
    // A number alone is read as an index where it is typed.
    if name.starts_with(|first: char| first.is_ascii_digit()) { format!("object_{name}") } else { name }
}

#[cfg(test)]
mod tests {
    use super::*;
    use devices::names::standard_object;

    #[test]
    fn a_name_becomes_words_and_words_become_the_name() {
        for (typed, shown) in [
            ("rpdo1_parameter", "RPDO1 parameter"),
            ("cob_id_emcy", "COB ID EMCY"),
            ("identity_object", "Identity object"),
        ] {
            assert_eq!(words(typed), shown);
            assert_eq!(name(shown), typed);
        }
        assert_eq!(name("COB-ID (EMCY)"), "cob_id_emcy");
        assert_eq!(name("2nd axis"), "object_2nd_axis");
        assert_eq!(name("\u{4f60}"), "");
    }

    #[test]
    fn a_name_that_is_shared_is_numbered_and_gets_no_number_that_another_has() {
        let mut names = ["Gain", "Gain 2", "Speed", "Gain", "Gain"].map(str::to_owned);
        number_shared(names.iter_mut());
        assert_eq!(names, ["Gain", "Gain 2", "Speed", "Gain 3", "Gain 4"]);
    }

    #[test]
    fn the_names_of_the_standards_are_typed_as_those_of_a_file_are() {
        let title = |index| standard_object(index).map(|standard| (standard.title, standard.name));
        let all: Vec<_> = (0x1000..=0x67FF).filter_map(title).collect();
        assert!(all.len() > 100);
        all.iter().for_each(|(title, typed)| assert_eq!(name(title), *typed));
    }

    #[test]
    fn names_of_a_file_are_ascii_without_what_cuts_them() {
        assert_eq!(plain("0.1 \u{b0}C; gain #1 = \u{b5}\n"), "0.1 degC, gain ,1 , u");
    }
}
