//! `ferrodrive params diff` and `verify`.

use std::path::Path;

use host::network::params::{
    DiffReport, Shown, VerifyReport, diff_of_files, diff_of_node, source as files, verify_node,
};
use words::counted;
use words::node::node;

use super::source;
use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use crate::plain::plain;
use plot::Paint;
use plot::Table;

impl super::Diff {
    pub(super) async fn run(&self, context: &Context) -> Result<DiffReport, Failure> {
        let Ok(id) = node(&self.first) else {
            return Ok(diff_of_files(Path::new(&self.first), &self.second)?);
        };
        let drive = context.drive(id).await?;
        let wanted = files::read(&self.second, drive.description(), Some(id))?;
        Ok(diff_of_node(&drive, &wanted, self.second.display().to_string()).await?)
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
