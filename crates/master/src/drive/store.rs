use std::time::Duration;

use canopen::Mux;
use devices::Write;

use super::handle::{Drive, POLL};
use crate::error::Error;

/// How long a drive may take to write its whole parameter memory before it answers: EEPROMs take 5 to 10 ms a page.
const STORE_TIMEOUT: Duration = Duration::from_secs(3);

/// The drive's own parameter memory, by the model's own commands.
impl Drive {
    /// Checks that [`save`](Self::save) can be asked of it, and asks for nothing else than its identity.
    ///
    /// # Errors
    /// As `save`.
    pub async fn check_save(&self) -> Result<(), Error> {
        self.save_write().await.map(|_| ())
    }

    /// Stores all parameters. It is done when the drive has answered, or, of a model that has
    /// [`saved`](devices::ParameterStorage::saved), when the object reads that.
    ///
    /// # Errors
    /// [`Error::NoParameterStore`]; [`Error::NotStored`]; [`Error::UnknownModel`], [`Error::GuessedModel`], [`Error::WrongModel`], [`Error::OtherModel`], and nothing is
    /// written: what means "save" to one model may be anything to another of the same identity. Those of the SDO write.
    pub async fn save(&self) -> Result<(), Error> {
        let save = self.save_write().await?;
        self.command(save).await?;
        match self.description().and_then(|description| description.storage.saved) {
            Some(done) => self.stored(save.object, i64::from(done)).await,
            None => Ok(()),
        }
    }

    /// Waits until `object` reads `done`.
    async fn stored(&self, object: Mux, done: i64) -> Result<(), Error> {
        let network = self.node.network();
        let begun = network.now();
        loop {
            let found = self.patient().read_number(object).await?;
            if found == done {
                return Ok(());
            }
            if network.now() - begun >= STORE_TIMEOUT {
                return Err(Error::NotStored { node: self.node.id(), mux: object, found, done, waited: STORE_TIMEOUT });
            }
            network.sleep(POLL).await;
        }
    }

    async fn save_write(&self) -> Result<Write, Error> {
        let description = self.named("save its parameters")?;
        let model = description.title;
        let save = description.storage.save.ok_or(Error::NoParameterStore { node: self.node.id(), model })?;
        self.check_identity().await?;
        Ok(save)
    }

    /// Puts all parameters back to their factory values. Some take effect after a restart only.
    ///
    /// # Errors
    /// As [`save`](Self::save); [`Error::NoFactorySettings`] for a model without that function.
    pub async fn restore(&self) -> Result<(), Error> {
        let description = self.named("restore its factory settings")?;
        let model = description.title;
        let restore = description.storage.restore.ok_or(Error::NoFactorySettings { node: self.node.id(), model })?;
        self.check_identity().await?;
        self.command(restore).await
    }

    async fn command(&self, write: Write) -> Result<(), Error> {
        self.patient().write_number(write.object, i64::from(write.value)).await
    }

    fn patient(&self) -> Self {
        Self { node: self.node.clone().with_timeout(STORE_TIMEOUT), ..self.clone() }
    }
}
