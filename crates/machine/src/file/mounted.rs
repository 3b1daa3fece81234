//! What an encoder is mounted on: `shaft` of a drive's table.

use canopen::NodeId;
use sim::{Place, World};

use words::document::reader::Table;
use words::document::{BadFile, Located, Problem};

const SHAFT: &str = "the node whose shaft it sits on, e.g. 4, or \"5.2\" for an axis of one";

/// The shaft of another node.
#[derive(Clone, Debug)]
pub(super) struct MountedOn {
    shaft: Place,
    at: Located,
}

impl MountedOn {
    /// What a drive's table has of it.
    pub(super) fn parse(table: &Table<'_>) -> Result<Option<Self>, Problem> {
        let Some(field) = table.get("shaft") else { return Ok(None) };
        let shaft = field.word(SHAFT)?.parse().map_err(|()| field.wrong(SHAFT))?;
        Ok(Some(Self { shaft, at: field.problem("").locate(table.text()) }))
    }

    /// Puts the encoder `node` there; both are in the world already.
    pub(super) fn take(&self, world: &mut World, node: NodeId) -> Result<(), BadFile> {
        let mounted = world.mount(node.raw(), self.shaft).map_err(|error| error.to_string());
        let reason = mounted.and_then(|mounted| mounted.map_err(|refused| refused.to_string()));
        reason.map_err(|reason| {
            BadFile::one(self.at.saying(format!("node {node} cannot sit on the shaft of {}: {reason}", self.shaft)))
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::file::Machine;

    fn refusal(text: &str) -> String {
        Machine::parse(text).and_then(|machine| machine.build()).map_or_else(|bad| bad.to_string(), |_| String::new())
    }

    #[test]
    fn an_encoder_sits_on_the_shaft_of_a_node_that_has_one() {
        let with = |shaft: &str| {
            let nodes = "[[drive]]\nmodel = 'cia402'\nnode = 5\n[[drive]]\nmodel = 'io401'\nnode = 7\n";
            refusal(&format!("{nodes}[[drive]]\nmodel = 'encoder406'\nnode = 6\nshaft = {shaft}\n"))
        };
        assert_eq!([with("5"), with("'5.1'")], ["", ""]);
        assert!(
            with("9").contains("line 10, column 9: node 6 cannot sit on the shaft of 9: there is no drive 9"),
            "{}",
            with("9")
        );
        assert!(
            with("7").contains("no shaft that an encoder could sit on") && with("6").contains("no shaft that"),
            "{}",
            with("6")
        );
        assert!(with("'5.2'").contains("axis"), "{}", with("'5.2'"));
        assert!(with("true").contains("expected the node whose shaft it sits on"));
        assert!(refusal("[[drive]]\nmodel = 'zlac8030l'\nnode = 4\nshaft = 4").contains("it is not an encoder"));
    }
}
