//! Lines of a scenario's host: the words behind a command, some of which have a value.

/// Takes the words of a line of this form. `take` is called with each, and with what gives its value where it has one; it returns false
/// for a word that is not a part of the line.
///
/// # Errors
/// Such a word, one whose value is missing, and what `take` says; with the form.
pub fn take<'a>(
    form: &str,
    words: impl IntoIterator<Item = &'a str>,
    mut take: impl FnMut(&'a str, &mut dyn FnMut() -> Result<&'a str, String>) -> Result<bool, String>,
) -> Result<(), String> {
    let mut words = words.into_iter();
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or_else(|| format!("'{word}' has no value; expected: {form}"));
        if !take(word, &mut value)? {
            // The command itself: what is typed as it stands.
            let is_typed = |word: &&str| word.chars().all(|c| c.is_ascii_lowercase() || c == '-');
            let command: Vec<_> = form.split(' ').take_while(is_typed).collect();
            return Err(format!("'{word}' is not a part of {}; expected: {form}", command.join(" ")));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_taken_with_their_values_and_others_are_refused() {
        let form = "wind up [for TIME] [again]";
        let taken = |text: &'static str| {
            let (mut time, mut again) = (None, false);
            take(form, text.split(' '), |word, value| {
                match word {
                    "for" => time = Some(value()?),
                    "again" => again = true,
                    _ => return Ok(false),
                }
                Ok(true)
            })
            .map(|()| (time, again))
        };
        assert_eq!(taken("again for 3s"), Ok((Some("3s"), true)));
        assert_eq!(taken("again for"), Err(format!("'for' has no value; expected: {form}")));
        assert_eq!(taken("for 3s twice"), Err(format!("'twice' is not a part of wind up; expected: {form}")));
    }
}
