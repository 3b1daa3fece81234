//! The part of docs/conformance.md about stacks of other people: its table is written here, and what people wrote about the
//! cases that failed is compared with those that did. What they wrote has to have frames: a claim about the work of others that
//! cannot be looked at is refused.

use std::collections::BTreeSet;

const HEAD: &str = "| stack | passed | failed | not applicable, not run |";

/// The page with this row in its table, in place of that of the same stack.
pub(super) fn with_row(page: &str, stack: &str, counts: [u64; 3]) -> Result<String, String> {
    let [passed, failed, other] = counts;
    let row = format!("| {stack} | {passed} | {failed} | {other} |");
    let mut lines: Vec<&str> = page.lines().collect();
    let head = lines.iter().position(|line| *line == HEAD).ok_or(format!("expected a table with {HEAD}"))?;
    let rows = lines[head..].iter().take_while(|line| line.starts_with('|')).count();
    let own = format!("| {stack} |");
    match lines[head..head + rows].iter().position(|line| line.starts_with(&own)) {
        Some(place) => lines[head + place] = &row,
        None => lines.insert(head + rows, &row),
    }
    Ok(lines.join("\n") + "\n")
}

/// The cases that the page's section on a stack is about; the section begins with `**STACK.**`. A row without a frame, or
/// without the clause, is an error.
pub(super) fn explained(page: &str, stack: &str) -> Result<BTreeSet<String>, String> {
    let start = format!("**{stack}.**");
    let mut lines = page.lines().skip_while(|line| !line.starts_with(&start));
    if lines.next().is_none() {
        return Ok(BTreeSet::new());
    }
    let section = lines.take_while(|line| !line.starts_with("**") && !line.starts_with('#'));
    let mut cases = BTreeSet::new();
    for row in section.filter_map(|line| line.strip_prefix("| ")) {
        let cells: Vec<&str> = row.trim_end_matches(" |").split(" | ").collect();
        let [named, seen, clause] = cells[..] else {
            return Err(format!("{stack}: expected cases, what was seen and the clause, got '{row}'"));
        };
        if named == "cases" {
            continue;
        }
        // Text in backquotes is each second part.
        if !seen.split('`').skip(1).step_by(2).any(is_frame) {
            return Err(format!("{stack}: {named}: expected a frame such as `605#4000100000000000` in what was seen"));
        }
        if !clause.starts_with("CiA ") {
            return Err(format!("{stack}: {named}: expected a clause such as 'CiA 301, 7.2.4.3.17', got '{clause}'"));
        }
        cases.extend(ids(named)?);
    }
    Ok(cases)
}

/// `605#4000100000000000`, `080#` or `185#R8`: an identifier of three digits, and whole bytes or a remote frame.
fn is_frame(text: &str) -> bool {
    let hexadecimal = |digits: &str| digits.bytes().all(|digit| matches!(digit, b'0'..=b'9' | b'A'..=b'F'));
    let Some((id, data)) = text.split_once('#') else { return false };
    let whole = match data.strip_prefix('R') {
        Some(length) => matches!(length.as_bytes(), [] | [b'0'..=b'8']),
        None => data.len() <= 16 && data.len() % 2 == 0 && hexadecimal(data),
    };
    id.len() == 3 && hexadecimal(id) && whole
}

/// `SDO 05, 07, PDO 23 to 25`.
fn ids(cell: &str) -> Result<Vec<String>, String> {
    let mut group = "";
    let mut found = Vec::new();
    for part in cell.split(", ") {
        let numbers = match part.split_once(' ') {
            Some((name, rest)) if name.starts_with(|first: char| first.is_ascii_uppercase()) => {
                group = name;
                rest
            }
            _ => part,
        };
        let (first, last) = numbers.split_once(" to ").unwrap_or((numbers, numbers));
        let number = |text: &str| {
            text.parse::<u8>().map_err(|_| format!("expected cases such as 'SDO 05, 07 to 09', got '{cell}'"))
        };
        found.extend((number(first)?..=number(last)?).map(|number| format!("{group} {number:02}")));
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = "# Page\n\n| stack | passed | failed | not applicable, not run |\n|---|---|---|---|\n| a 1 | 1 | 2 | 3 |\n\n\
                        **a 1.** All theirs.\n\n| cases | seen | clause |\n|---|---|---|\n| SDO 05, 07, PDO 23 to 25 | x, `605#40` `585#` | CiA 301, 7.2 |\n\n\
                        **b.** None.\n";

    #[test]
    fn a_row_takes_the_place_of_the_one_before_or_comes_last() {
        let page = with_row(PAGE, "a 1", [4, 5, 6]).unwrap();
        assert!(page.contains("|---|\n| a 1 | 4 | 5 | 6 |\n\n**a 1.**"), "{page}");
        let page = with_row(PAGE, "b", [7, 8, 9]).unwrap();
        assert!(page.contains("| a 1 | 1 | 2 | 3 |\n| b | 7 | 8 | 9 |\n\n"), "{page}");
        assert!(with_row("no table", "b", [0; 3]).is_err());
    }

    #[test]
    fn cases_of_a_section_are_those_of_its_table() {
        let cases: Vec<_> = explained(PAGE, "a 1").unwrap().into_iter().collect();
        assert_eq!(cases, ["PDO 23", "PDO 24", "PDO 25", "SDO 05", "SDO 07"]);
        assert!(explained(PAGE, "b").unwrap().is_empty());
        assert!(explained(&PAGE.replace("05, 07", "05 and 07"), "a 1").is_err());
    }

    #[test]
    fn a_row_without_a_frame_or_a_clause_is_refused() {
        for without in ["x, 605#40 and 585#", "x, `PDO 23`", "x, `605#4` `60#40` `185#R9` `605#4x`"] {
            let page = PAGE.replace("x, `605#40` `585#`", without);
            assert_ne!(page, PAGE);
            let refused = explained(&page, "a 1").unwrap_err();
            assert!(refused.starts_with("a 1: SDO 05, 07, PDO 23 to 25: expected a frame"), "{without}: {refused}");
        }
        for with in ["`185#R8`", "`object` and `080#`", "nothing after `705#R`", "`605#4000100000000000`"] {
            assert!(explained(&PAGE.replace("x, `605#40` `585#`", with), "a 1").is_ok(), "{with}");
        }
        assert!(explained(&PAGE.replace("CiA 301, 7.2", "y"), "a 1").is_err());
        assert!(explained(&PAGE.replace(" | CiA 301, 7.2", ""), "a 1").is_err());
    }

    #[test]
    fn the_page_explains_as_many_cases_as_its_table_counts() {
        let path = crate::workspace::root().join(super::super::PAGE);
        let page = std::fs::read_to_string(path).unwrap();
        for stack in super::super::STACKS {
            let own = format!("| {} |", stack.name);
            let row = page.lines().find_map(|line| line.strip_prefix(&own)).expect(stack.name);
            let failed = row.split(" | ").nth(1).expect(row);
            let cases = explained(&page, stack.name).unwrap();
            assert_eq!(cases.len().to_string(), failed, "{}: {cases:?}", stack.name);
        }
    }
}
