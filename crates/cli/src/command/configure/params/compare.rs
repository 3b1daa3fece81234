//! `ferrodrive params diff` and `verify`.

use console::command::params::text_of_differences;
use host::network::params::{
    DiffReport, VerifyReport, diff_of_files, diff_of_node, diff_of_nodes, source as files, verify_node,
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
        match (&self.first, &self.second) {
            (NodeOrFile::Node(first), NodeOrFile::Node(second)) => {
                let first = context.drive(*first).await?;
                Ok(diff_of_nodes(&first, &context.drive(*second).await?).await?)
            }
            (NodeOrFile::Node(first), NodeOrFile::File(file)) => {
                let drive = context.drive(*first).await?;
                let wanted = files::read(file, drive.description(), Some(*first))?;
                Ok(diff_of_node(&drive, &wanted, file.display().to_string()).await?)
            }
            (NodeOrFile::File(first), NodeOrFile::File(second)) => Ok(diff_of_files(first, second)?),
            (NodeOrFile::File(file), NodeOrFile::Node(node)) => {
                let failure = Failure::usage("the node is named first, then the file that it is compared with");
                Err(failure.next(format!("ferrodrive params diff {node} {}", file.display())))
            }
        }
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
        text_of_differences(self, paint)
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
