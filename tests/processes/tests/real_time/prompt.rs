//! What `ferrodrive tune --apply` asks a person at a terminal, which `script` (util-linux) makes: whether the new gains stay. The drive and its
//! time are virtual.
#![cfg(unix)]

use super::top::Terminal;

#[test]
fn at_a_terminal_one_key_goes_back_to_the_former_gains_and_enter_keeps_the_new_ones() {
    for (key, said) in [("b\n", "it was given its former gains back"), ("\n", "the drive has the proposed values")] {
        let Some(mut terminal) = Terminal::of("tune 4 --apply") else { return };
        terminal.wait_for("Enter keeps them");
        terminal.press(key);
        terminal.wait_for(said);
    }
}
