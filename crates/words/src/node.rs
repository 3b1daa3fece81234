//! Node-IDs, and `all` where a command may address every node.

use canopen::NodeId;

const EXPECTED: &str = "a node-ID is a number from 1 to 127, e.g. 4";

/// `4`.
pub fn node(text: &str) -> Result<NodeId, String> {
    let number: u8 = text.parse().map_err(|_| format!("'{text}' is not a node-ID; {EXPECTED}"))?;
    NodeId::new(number).ok_or_else(|| format!("there is no node {number}; {EXPECTED}"))
}

/// One node or all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Nodes {
    /// Every node on the bus.
    All,
    /// This one.
    One(NodeId),
}

/// `4` or `all`.
pub fn nodes(text: &str) -> Result<Nodes, String> {
    if text.eq_ignore_ascii_case("all") {
        return Ok(Nodes::All);
    }
    node(text).map(Nodes::One).map_err(|error| format!("{error}, or the word all"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_are_one_to_127_or_all() {
        assert_eq!(nodes("all"), Ok(Nodes::All));
        assert_eq!(nodes("127"), Ok(Nodes::One(NodeId::MAX)));
        for wrong in ["0", "128", "-1", "four", ""] {
            assert!(nodes(wrong).unwrap_err().contains("1 to 127"), "{wrong:?}");
        }
    }
}
