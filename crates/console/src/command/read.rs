//! `ferrodrive read`: objects of a node by SDO upload (CiA 301, clause 7.2.4), one, several or a range.

use canopen::{AbortCode, Mux, NodeId};
use master::core::Payload;
use master::decode::common_row;
use master::{Drive, Error};
use words::node::node;
use words::object::ObjectArg;
use words::selection::{Selection, selection};

use super::object::{ObjectReport, moving_limits, resolve};
use crate::context::Context;
use crate::failure::Failure;

/// What an object is named by, and examples, for the help.
pub const HELP: &str = "Objects are hexadecimal indices or names:\n  6064, 0x6064, 6064h, 2026:01, position_actual_value\n\
    Several at once:\n  1018:*        all sub-indices\n  1600:1..4     some of them\n  1000..1FFF    every object between these indices\n\
    Examples:\n  ferrodrive read 4 6064 606C statusword\n  ferrodrive read 4 1018:*";

/// Read objects of a node, decoded with unit and meaning
#[derive(Debug, clap::Args)]
// The command line has options beside, in a struct of the same name: clap has a group for each struct.
#[group(id = "objects_of_a_node")]
#[command(after_help = HELP)]
pub struct Read {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// Indices, index:sub-index, names or ranges
    #[arg(value_name = "OBJECT", required = true, value_parser = selection)]
    objects: Vec<Selection>,
}

impl Read {
    /// The object, if it is a single one.
    pub fn one(&self) -> Option<&ObjectArg> {
        match &self.objects[..] {
            [Selection::One(object)] => Some(object),
            _ => None,
        }
    }

    /// Reads, decodes and shows one after the other.
    ///
    /// # Errors
    /// What `show` fails with; the node has nothing of a selection; an error of the master. Where something was shown before, it
    /// is said to be a part.
    pub async fn run(
        &self,
        context: &Context,
        mut show: impl FnMut(&ObjectReport) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        if let Some(object) = self.one() {
            return show(&self.read_one(context, object).await?.0);
        }
        let mut partial = false;
        let show = |report: &ObjectReport| {
            show(report)?;
            partial = true;
            Ok(())
        };
        self.run_several(context, show).await.map_err(|failure| Failure { partial, ..failure })
    }

    async fn run_several(
        &self,
        context: &Context,
        mut show: impl FnMut(&ObjectReport) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let drive = context.drive(self.node).await?;
        for selection in &self.objects {
            let mut found = 0;
            let mut last = None;
            let mut absent = None;
            for mux in self.candidates(&drive, selection)? {
                // Of an index that is not there no other sub-index is either.
                if mux.sub_index > 0 && last == Some((mux.index, false)) {
                    continue;
                }
                context.show(format!("node {}: {mux}", self.node));
                let there = self.all_of(&drive, mux).await?;
                last = Some((mux.index, there.is_ok()));
                match there {
                    Ok(reports) => {
                        found += reports.len();
                        reports.iter().try_for_each(&mut show)?;
                    }
                    Err(error) => absent = absent.or(Some(error)),
                }
            }
            if found == 0 {
                return Err(self.nothing(selection, absent));
            }
        }
        Ok(())
    }

    /// One object, and its bytes. A number is asked for before the model, so that an absent node is blamed for the object that was
    /// wanted.
    ///
    /// # Errors
    /// Those of the master.
    pub async fn read_one(&self, context: &Context, object: &ObjectArg) -> Result<(ObjectReport, Payload), Failure> {
        let early = match object {
            ObjectArg::Mux(mux) => Some(context.node(self.node).upload(*mux).await?),
            ObjectArg::Name(_) => None,
        };
        let drive = context.drive(self.node).await?;
        let (mux, row) = resolve(&drive, object)?;
        let payload = match early {
            Some(payload) => payload,
            None => drive.node().upload(mux).await?,
        };
        let row = if drive.description().is_some() { row } else { common_row(mux) };
        let limits = moving_limits(&drive, row).await?;
        Ok((ObjectReport::new(&drive, mux, row, payload.as_bytes(), limits.as_ref(), false), payload))
    }

    /// The objects to ask for: those of the model's table, else sub-index 0 of each index, from which others follow.
    fn candidates(&self, drive: &Drive, selection: &Selection) -> Result<Vec<Mux>, Failure> {
        let (first, last, subs) = match selection {
            Selection::One(object) => return Ok(vec![resolve(drive, object)?.0]),
            Selection::SubIndices(index, Some((from, to))) => {
                return Ok((*from..=*to).map(|sub| Mux::new(*index, sub)).collect());
            }
            Selection::SubIndices(index, None) => (*index, *index, true),
            Selection::Indices(first, last) => (*first, *last, false),
        };
        let rows = drive.description().map(|model| model.dictionary.rows());
        let listed = rows.into_iter().flatten().filter(|row| (first..=last).contains(&row.index));
        let listed: Vec<Mux> = listed.map(|row| row.mux()).collect();
        // A device may have what its model's table lacks; for one named index this is reported.
        let named = subs && listed.is_empty();
        Ok(match drive.description() {
            Some(_) if !named => listed,
            _ => (first..=last).map(|index| Mux::new(index, 0)).collect(),
        })
    }

    /// The object, and where no table lists sub-indices those that follow from sub-index 0; or the node's answer that it is not there.
    async fn all_of(&self, drive: &Drive, mux: Mux) -> Result<Result<Vec<ObjectReport>, Error>, Failure> {
        let first = match self.look(drive, mux).await? {
            Ok(first) => first,
            Err(absent) => return Ok(Err(absent)),
        };
        let is_listed = drive.description().is_some_and(|model| model.row(mux).is_some());
        let count = first.number().filter(|_| mux.sub_index == 0 && !is_listed).unwrap_or(0);
        let mut reports = vec![first];
        for sub_index in 1..=u8::try_from(count).unwrap_or(0).min(254) {
            match self.look(drive, Mux::new(mux.index, sub_index)).await? {
                Ok(report) => reports.push(report),
                // The value of a variable is not a count of sub-indices.
                Err(_) if sub_index == 1 => break,
                Err(_) => {}
            }
        }
        Ok(Ok(reports))
    }

    /// Reads an object; or the node's answer that it is not there. Another refusal is something to show.
    async fn look(&self, drive: &Drive, mux: Mux) -> Result<Result<ObjectReport, Error>, Failure> {
        let row = match drive.description() {
            Some(model) => model.row(mux),
            None => common_row(mux),
        };
        match drive.node().upload(mux).await {
            Ok(payload) => {
                let limits = moving_limits(drive, row).await?;
                Ok(Ok(ObjectReport::new(drive, mux, row, payload.as_bytes(), limits.as_ref(), false)))
            }
            Err(absent @ Error::Aborted { code: AbortCode::NO_SUCH_OBJECT | AbortCode::NO_SUCH_SUB_INDEX, .. }) => {
                Ok(Err(absent))
            }
            Err(Error::Aborted { code, .. }) => {
                let mut report = ObjectReport::new(drive, mux, row, &[], None, false);
                report.refused = Some(code.to_string());
                Ok(Ok(report))
            }
            Err(error) => Err(error.into()),
        }
    }

    /// That a node has nothing of a selection, with its answer to the first object that was asked for.
    fn nothing(&self, selection: &Selection, absent: Option<Error>) -> Failure {
        let answer = absent.map(Failure::from);
        let what = match (selection, &answer) {
            (Selection::Indices(first, last), _) => format!("has no object from {first:04X}h to {last:04X}h"),
            // Of one object the answer says all.
            (_, Some(answer)) => return answer.clone(),
            (_, None) => "has no such object".to_owned(),
        };
        let mut failure = Failure::new(format!("node {} {what}", self.node))
            .of_kind("aborted")
            .next(format!("ferrodrive objects {} lists what it has", self.node));
        failure.subject = answer.map_or(failure.subject, |answer| answer.subject);
        failure.at_node(self.node)
    }
}
