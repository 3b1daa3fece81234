//! "Did you mean": the nearest of some known words.

/// Up to three of `known` that are near `typed`: those that contain it, else those within a few slips of the keys.
pub fn near<'a>(typed: &str, known: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    const MOST: usize = 3;
    let typed = typed.to_ascii_lowercase();
    let mut scored: Vec<(usize, &str)> = known
        .into_iter()
        .filter_map(|word| {
            let contained = !typed.is_empty() && word.contains(&typed);
            let distance = distance(&typed, word);
            (contained || distance <= 1 + typed.chars().count() / 4).then_some((distance, word))
        })
        .collect();
    scored.sort();
    scored.dedup();
    scored.into_iter().take(MOST).map(|(_, word)| word).collect()
}

/// Edits (insert, delete, replace) that turn one word into the other.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, to) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(from != *to);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

/// `; did you mean a, b?`, or nothing.
pub fn did_you_mean(near: &[&str]) -> String {
    if near.is_empty() { String::new() } else { format!("; did you mean {}?", near.join(", ")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WORDS: [&str; 3] = ["position_actual_value", "velocity_actual_value", "controlword"];

    #[test]
    fn slips_and_parts_are_recognised() {
        assert_eq!(near("controlwrod", WORDS), ["controlword"]);
        assert_eq!(near("velocity", WORDS), ["velocity_actual_value"]);
        assert_eq!(near("Position_actual_vale", WORDS)[0], "position_actual_value");
        assert!(near("zebra", WORDS).is_empty());
    }

    #[test]
    fn distances_are_edits() {
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("sitting", "kitten"), 3);
        assert_eq!(distance("", "ab"), 2);
    }
}
