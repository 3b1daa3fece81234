//! A node's configuration as one thing, for Python: kept, compared, written as a transaction, checked. The results are those of
//! `ferrodrive params`.

use std::path::PathBuf;

use devices::Description;
use host::network::params::journal::{default_path, roll_back_by};
use host::network::params::{
    Proof, Transaction, back_up, bytes_of, diff_of_node, diff_of_nodes, plan_of, source, verify_node,
};
use machine::parameters::{Form, sheet};
use master::parameters::Parameters;
use pyo3::prelude::*;
use words::failure::Failure;

use super::value::Value;
use super::whole::AskedDrive;
use super::{Job, Network, duration};
use crate::failure::bad_value;

impl AskedDrive {
    /// What the node is to have: as this file has it, or the machine file.
    fn wanted(
        &self,
        file: Option<&PathBuf>,
        model: Option<&'static Description>,
    ) -> Result<(Parameters, String), Failure> {
        match (file, &self.machine) {
            (Some(path), _) => Ok((source::read(path, model, Some(self.node))?, path.display().to_string())),
            (None, Some(machine)) => source::of_machine(machine, self.node),
            (None, None) => Err(Failure::usage("which parameters?")
                .at_node(self.node)
                .next("name their file, or give the network a machine file: Network(bus, machine=FILE)")),
        }
    }
}

/// Reads all parameters of a node's model: the report, and what a file of this name has, if there is to be one.
#[pyfunction]
pub(crate) fn params_backup(
    py: Python<'_>,
    network: &Bound<'_, Network>,
    node: u8,
    model: Option<&str>,
    file: Option<PathBuf>,
) -> PyResult<Job> {
    let asked = AskedDrive::of(network.get(), node, model)?;
    // Before any request: no upload for a file that cannot be written.
    let form = file.as_deref().map(Form::of).transpose().map_err(bad_value)?;
    network.get().begin_said(py, async move {
        let drive = asked.drive().await?;
        let (mut report, parameters, model) = back_up(&(), &drive).await?;
        let bytes = match (&file, form) {
            (Some(path), Some(form)) => {
                report.file = Some(path.display().to_string());
                Value::Bytes(bytes_of(&parameters, model, path, form)?)
            }
            _ => {
                report.parameters = Some(sheet::print(&parameters, Some(model)));
                Value::None
            }
        };
        Ok(Value::List(vec![Value::report(&report), bytes]))
    })
}

/// What is asked about a node and what it is to have.
#[derive(Clone, Copy)]
enum Question {
    /// In what they differ.
    Diff,
    /// What would be written, in its order; with node-ID and bit rate or without.
    Plan { address: bool },
    /// Whether the node has it.
    Verify,
}

/// Compares a node with what it is to have, as `question` has it: `diff`, `plan`, `plan with address`, `verify`. Nothing is written.
#[pyfunction]
pub(crate) fn params_compare(
    py: Python<'_>,
    network: &Bound<'_, Network>,
    node: u8,
    model: Option<&str>,
    file: Option<PathBuf>,
    question: &str,
) -> PyResult<Job> {
    let question = match question {
        "diff" => Question::Diff,
        "plan" => Question::Plan { address: false },
        "plan with address" => Question::Plan { address: true },
        "verify" => Question::Verify,
        other => return Err(bad_value(format!("{other:?} is not asked of parameters"))),
    };
    let asked = AskedDrive::of(network.get(), node, model)?;
    network.get().begin_said(py, async move {
        let drive = asked.drive().await?;
        let (wanted, name) = asked.wanted(file.as_ref(), drive.description())?;
        Ok(match question {
            Question::Diff => Value::report(&diff_of_node(&drive, &wanted, name).await?),
            Question::Plan { address } => Value::report(&plan_of(&(), &drive, &wanted, name, address).await?),
            Question::Verify => Value::report(&verify_node(&drive, &wanted, name).await?),
        })
    })
}

/// Compares two nodes.
#[pyfunction]
pub(crate) fn params_compare_nodes(
    py: Python<'_>,
    network: &Bound<'_, Network>,
    node: u8,
    model: Option<&str>,
    other: u8,
) -> PyResult<Job> {
    let network = network.get();
    let (first, second) = (AskedDrive::of(network, node, model)?, AskedDrive::of(network, other, None)?);
    network.begin_said(py, async move {
        let (first, second) = (first.drive().await?, second.drive().await?);
        Ok(Value::report(&diff_of_nodes(&first, &second).await?))
    })
}

/// How a transaction is made, in plain values.
#[derive(FromPyObject)]
pub(crate) struct TransactionOrder {
    #[pyo3(item)]
    address: bool,
    #[pyo3(item)]
    save: bool,
    #[pyo3(item)]
    prove: Option<String>,
    #[pyo3(item)]
    within: f64,
    #[pyo3(item)]
    journal: Option<PathBuf>,
}

impl TransactionOrder {
    fn transaction(self, asked: &AskedDrive) -> PyResult<Transaction> {
        let prove = match self.prove.as_deref() {
            None => None,
            Some(_) if !self.save => {
                return Err(bad_value("prove needs save=True: what is not stored is gone after a start"));
            }
            Some("reset") => Some(Proof::Reset),
            Some("power-cycle") => Some(Proof::PowerCycle),
            Some(other) => {
                return Err(bad_value(format!("expected prove=\"reset\" or \"power-cycle\", got {other:?}")));
            }
        };
        Ok(Transaction {
            address: self.address,
            save: self.save,
            prove,
            within: duration(self.within)?,
            journal: asked.journal(self.journal),
            on_kept: |_| (),
        })
    }
}

/// Writes a file's parameters to a node: all or none.
#[pyfunction]
pub(crate) fn params_apply(
    py: Python<'_>,
    network: &Bound<'_, Network>,
    node: u8,
    model: Option<&str>,
    file: Option<PathBuf>,
    order: TransactionOrder,
) -> PyResult<Job> {
    let asked = AskedDrive::of(network.get(), node, model)?;
    let transaction = order.transaction(&asked)?;
    network.get().begin_said(py, async move {
        let drive = asked.drive().await?;
        if transaction.save {
            // Parameters that cannot be stored were not asked for.
            drive.check_save().await?;
        }
        let (wanted, name) = asked.wanted(file.as_ref(), drive.description())?;
        Ok(Value::report(&transaction.apply(&(), &drive, &wanted, name).await?))
    })
}

/// Goes back to how a node was before a transaction that was broken off.
#[pyfunction]
pub(crate) fn params_rollback(
    py: Python<'_>,
    network: &Bound<'_, Network>,
    node: u8,
    model: Option<&str>,
    journal: Option<PathBuf>,
) -> PyResult<Job> {
    let asked = AskedDrive::of(network.get(), node, model)?;
    network.get().begin_said(py, async move {
        let path = journal.unwrap_or_else(|| default_path(asked.node));
        let drive = asked.drive().await?;
        Ok(Value::report(&roll_back_by(&path, &drive).await?))
    })
}
