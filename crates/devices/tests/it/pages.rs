//! The tables of fault codes in the pages of the drives are those of the descriptions.

#[test]
fn the_pages_of_the_drives_have_the_fault_codes_with_their_remedies() {
    for name in ["zlac8030l", "zlim42c"] {
        let page = format!("{}/../../docs/drives/{name}.md", env!("CARGO_MANIFEST_DIR"));
        let page = std::fs::read_to_string(page).unwrap();
        let begin = "| 603Fh | fault | what to do |\n|---|---|---|\n";
        let table = page.split(begin).nth(1).and_then(|rest| rest.split("\n\n").next()).unwrap();
        let faults = devices::model(name).unwrap().faults.table;
        let rows: Vec<_> =
            faults.iter().map(|fault| format!("| {:04X}h | {} | {} |", fault.code, fault.name, fault.remedy)).collect();
        assert_eq!(table.lines().collect::<Vec<_>>(), rows, "{name}");
    }
}
