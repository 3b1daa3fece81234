//! `--control` and what goes with it.

use host::control::ControlAddress;
use tokio::sync::mpsc;

use serve::control::{ControlMessage, ControlServer, Entry};
use serve::messages::Messages;
use serve::world::ServedWorld;

use crate::failure::Failure;

/// Where the world can be commanded from, and by whom.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct ControlOptions {
    /// Serve world commands and events to other programs: HOST:PORT, or the path of a Unix socket
    ///
    /// Lines of JSON, for `ferrodrive world`, `ferrodrive events` and programs; docs/control.md describes them. On an
    /// address that other machines can reach a token is required.
    #[arg(long, value_name = "PLACE")]
    control: Option<ControlAddress>,
    /// Token that clients of --control have to give first (default, on an address that other machines can reach: a
    /// random one, printed on standard error)
    #[arg(
        long,
        value_name = "TOKEN",
        env = "FERRODRIVE_CONTROL_TOKEN",
        hide_env_values = true,
        hide_short_help = true,
        requires = "control"
    )]
    control_token: Option<String>,
}

impl ControlOptions {
    /// The place, if one is asked for.
    pub(crate) fn place(&self) -> Option<&ControlAddress> {
        self.control.as_ref()
    }

    /// The server, listening, if one is asked for; `world` then asks for the token.
    ///
    /// # Errors
    /// That it cannot listen there, or that the token is empty.
    pub(crate) async fn serve<T>(
        &self,
        world: &mut ServedWorld,
        requests: &mpsc::Sender<T>,
        warnings: &Messages,
    ) -> Result<Option<ControlServer>, Failure>
    where
        T: From<ControlMessage> + Send + 'static,
    {
        let Some(address) = &self.control else { return Ok(None) };
        let token = match &self.control_token {
            Some(token) if token.is_empty() => {
                return Err(
                    Failure::usage("the token of --control-token is empty").next("give one, or omit the option")
                );
            }
            Some(token) => Some(token.clone()),
            None if address.is_local() => None,
            None => {
                let token = random_token()?;
                warnings.say(&format!("note: clients of {address} have to give this token: {token}"));
                Some(token)
            }
        };
        let entry = if token.is_some() { Entry::ByToken } else { Entry::Free };
        token.into_iter().for_each(|token| world.ask_for_token(token));
        Ok(Some(ControlServer::bind(address, entry, requests.clone()).await?))
    }
}

/// 128 random bits in hexadecimal digits.
fn random_token() -> Result<String, Failure> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes)
        .map_err(|error| Failure::new("cannot make a token").because(error).next("give one with --control-token"))?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}
