//! `ferrodrive params diff` and `verify`.

use host::network::params::{
    DiffReport, Shown, VerifyReport, back_up, diff_of_files, diff_of_node, source as files, verify_node,
};
use words::counted;

use super::{NodeOrFile, source};
use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use crate::plain::plain;
use plot::Paint;
use plot::Table;

impl super::Diff {
    pub(super) async fn run(&self, context: &Context) -> Result<DiffReport, Failure> {
        let first = match (&self.first, &self.second) {
            (NodeOrFile::Node(first), _) => *first,
            (NodeOrFile::File(first), NodeOrFile::File(second)) => return Ok(diff_of_files(first, second)?),
            (NodeOrFile::File(file), NodeOrFile::Node(node)) => {
                let failure = Failure::usage("the node is named first, then the file that it is compared with");
                return Err(failure.next(format!("ferrodrive params diff {node} {}", file.display())));
            }
        };
        let drive = context.drive(first).await?;
        let (wanted, whose) = match &self.second {
            NodeOrFile::File(file) => {
                (files::read(file, drive.description(), Some(first))?, file.display().to_string())
            }
            NodeOrFile::Node(second) => {
                let (_, mut has, model) = back_up(&(), &context.drive(*second).await?).await?;
                // Two nodes have two node-IDs.
                has.values.retain(|object, _| !model.storage.address.contains(object));
                (has.for_node(first, Some(model)), format!("node {second}"))
            }
        };
        Ok(diff_of_node(&drive, &wanted, whose).await?)
    }
}

impl super::Verify {
    pub(super) async fn run(&self, context: &Context) -> Result<VerifyReport, Failure> {
        let drive = context.drive(self.wanted.node).await?;
        let (wanted, file) = source::wanted(context, &self.wanted, drive.description())?;
        Ok(verify_node(&drive, &wanted, file).await?)
    }
}

impl Report for DiffReport {
    fn text(&self, paint: Paint) -> String {
        let (first, second) = (plain(&self.first), plain(&self.second));
        if self.differences.is_empty() {
            return format!("{first} has the values of {second}");
        }
        let mut table = Table::new(&["object", "name", "first", "second"]);
        for row in &self.differences {
            let say = |shown: &Option<Shown>| shown.as_ref().map_or("-".to_owned(), |shown| plain(&shown.text));
            table.row([row.object.clone(), row.name.unwrap_or_default().to_owned(), say(&row.first), say(&row.second)]);
        }
        format!("first   {first}\nsecond  {second}\n\n{}", table.plain(paint))
    }
}

impl Report for VerifyReport {
    fn text(&self, paint: Paint) -> String {
        if self.ok {
            return format!(
                "node {} has the values of {}: {}",
                self.node,
                plain(&self.file),
                counted(self.compared, "object")
            );
        }
        let mut table = Table::new(&["object", "name", "should be", "is"]);
        for row in &self.deviations {
            let found = row.found.as_ref().map(|shown| shown.text.clone()).or_else(|| row.refused.clone());
            let name = row.name.unwrap_or_default().to_owned();
            table.row([row.object.clone(), name, plain(&row.wanted.text), plain(&found.unwrap_or_default())]);
        }
        table.plain(paint)
    }
}
