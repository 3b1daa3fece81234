//! What a node has: all parameters of its model, or those of a list.

use canopen::Mux;

use super::values::{Parameters, same, wanted_of};
use crate::drive::Drive;
use crate::error::Error;
use crate::identify::identity;
use crate::network::Node;

/// The parameters of a node, and what it refused to show.
#[derive(Clone, Debug)]
pub struct Backup {
    /// What it has.
    pub parameters: Parameters,
    /// Objects that it refused to show.
    pub refused: Vec<(Mux, Error)>,
}

/// An object that has not the value that it should have.
#[derive(Clone, Debug)]
pub struct Deviation {
    /// The object.
    pub object: Mux,
    /// What it should have.
    pub wanted: Vec<u8>,
    /// What it has, or why that is not known.
    pub found: Result<Vec<u8>, Error>,
}

impl Drive {
    /// Reads all parameters of its model. `progress` hears which of how many comes next.
    ///
    /// # Errors
    /// [`Error::UnknownModel`]; silence. An object that the node refuses is noted.
    pub async fn back_up(&self, mut progress: impl FnMut(usize, usize, Mux)) -> Result<Backup, Error> {
        let wanted = wanted_of(self.known("find out which of its objects are parameters")?);
        let node = self.node();
        let (identity, id) = (identity(node).await?, node.id());
        let mut parameters = Parameters { identity, node: Some(id), ..Parameters::default() };
        let mut refused = Vec::new();
        for (position, object) in wanted.iter().enumerate() {
            progress(position + 1, wanted.len(), *object);
            match node.upload(*object).await {
                Ok(payload) => {
                    parameters.values.insert(*object, payload.as_bytes().to_vec());
                }
                Err(error @ Error::Aborted { .. }) => refused.push((*object, error)),
                Err(error) => return Err(error),
            }
        }
        Ok(Backup { parameters, refused })
    }
}

/// Reads every object of a list and gives those that have another value.
///
/// # Errors
/// Silence. An object that the node refuses to show is a deviation.
pub async fn verify<'a>(
    node: &Node,
    wanted: impl IntoIterator<Item = (&'a Mux, &'a Vec<u8>)>,
) -> Result<Vec<Deviation>, Error> {
    let mut deviations = Vec::new();
    for (object, value) in wanted {
        let found = match node.upload(*object).await {
            Ok(payload) if same(*object, value, payload.as_bytes()) => continue,
            Ok(payload) => Ok(payload.as_bytes().to_vec()),
            Err(error @ Error::Aborted { .. }) => Err(error),
            Err(error) => return Err(error),
        };
        deviations.push(Deviation { object: *object, wanted: value.clone(), found });
    }
    Ok(deviations)
}
