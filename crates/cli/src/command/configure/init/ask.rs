//! Which model a node is, asked of a person at a terminal.

use std::io::{self, BufRead, Write};

use host::network::init::InitNode;

/// Asks for each node that may be one of several models; the end of the input leaves the rest as it is.
pub(super) fn all(
    nodes: Vec<InitNode>,
    input: &mut impl BufRead,
    output: &mut impl Write,
) -> io::Result<Vec<InitNode>> {
    let mut over = false;
    let mut asked = Vec::new();
    for node in nodes {
        let is_open = !over && !node.certain && node.models.len() > 1;
        asked.push(if is_open { one(node, &mut over, input, output)? } else { node });
    }
    Ok(asked)
}

fn one(node: InitNode, over: &mut bool, input: &mut impl BufRead, output: &mut impl Write) -> io::Result<InitNode> {
    let without = match (node.guess(), &node.evidence) {
        (Some(guess), Some(evidence)) => format!("Enter for {guess}, as it has {evidence}"),
        (Some(guess), None) => format!("Enter for {guess}"),
        (None, _) => "Enter to leave it open".to_owned(),
    };
    loop {
        write!(output, "node {}: which model is it? {} ({without}): ", node.node, node.models.join(", "))?;
        output.flush()?;
        let mut line = String::new();
        *over = input.read_line(&mut line)? == 0;
        let typed = line.trim();
        if typed.is_empty() {
            return Ok(node);
        }
        match node.models.iter().find(|model| model.eq_ignore_ascii_case(typed)).cloned() {
            Some(model) => return Ok(node.chosen(&model)),
            None => writeln!(output, "'{}' is not one of these", crate::plain::plain(typed))?,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use can::Bitrate;
    use canopen::NodeId;
    use master::Network;
    use sim::machine::{Order, order};
    use sim::{World, block_on};
    use words::models::resolve;

    use super::*;

    /// The rows of a joint at 1, a stepper at 2 and a servo of CiA 402 at 9, of which nothing is said.
    fn rows() -> Vec<InitNode> {
        let mut world = World::new(Bitrate::K500, 1);
        let network = Network::new();
        world.add_station(network.clone());
        for (name, id) in [("m4230e17b50", 1), ("zlim42c", 2), ("cia402", 9)] {
            let (model, node) = (resolve(name).unwrap(), NodeId::new(id).unwrap());
            world.add_drive(id, order(model, &Order::new(model, node, Bitrate::K500)).unwrap()).unwrap();
        }
        world.run_for(Duration::from_secs(2));
        let looked = async {
            let mut rows = Vec::new();
            for found in network.scan(Duration::from_millis(100), |_| {}).await {
                rows.push(InitNode::found(&network, None, &found).await);
            }
            rows
        };
        block_on(&mut world, looked).unwrap()
    }

    fn asked(typed: &str) -> (Vec<Option<String>>, String) {
        let mut shown = Vec::new();
        let rows = all(rows(), &mut typed.as_bytes(), &mut shown).unwrap();
        (rows.into_iter().map(|row| row.model).collect(), String::from_utf8(shown).unwrap())
    }

    fn models(names: [Option<&str>; 3]) -> Vec<Option<String>> {
        names.map(|name| name.map(str::to_owned)).to_vec()
    }

    #[test]
    fn what_may_be_several_models_is_asked_for_until_it_is_one_of_them() {
        let (chosen, shown) = asked("toaster\nM8025E25B80\nzlim42c-82\n");
        assert_eq!(chosen, models([Some("m8025e25b80"), Some("zlim42c-82"), Some("cia402")]));
        assert!(
            shown.contains("node 1: which model is it? m4230e17b50, ") && shown.contains("'toaster' is not"),
            "{shown}"
        );
        assert!(!shown.contains("node 9"), "{shown}");
    }

    #[test]
    fn enter_and_the_end_of_input_leave_the_guess_or_leave_it_open() {
        let (chosen, shown) = asked("\n\n");
        assert_eq!(chosen, models([None, Some("zlim42c"), Some("cia402")]));
        assert!(shown.contains("Enter to leave it open") && shown.contains("Enter for zlim42c, as it has "), "{shown}");
        let (chosen, shown) = asked("");
        assert_eq!(chosen, models([None, Some("zlim42c"), Some("cia402")]));
        assert!(!shown.contains("node 2"), "{shown}");
    }
}
