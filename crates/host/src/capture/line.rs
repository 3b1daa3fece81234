//! A capture as a line of a scenario's host: `4 capture velocity current for 2s rate 1ms`.

use std::str::FromStr;
use std::time::Duration;

use can::Bitrate;
use canopen::pdo::PdoId;
use machine::file::tpdo_id;
use master::Drive;
use words::failure::{Failure, both};
use words::time::some_time;

use super::commanded::measurands;
use super::{Restorer, Span, Taken, Trigger, Wanted};

/// Time between two readings, where nothing is said of it.
const RATE: Duration = Duration::from_millis(1);

/// A capture as a line of a host asks for it.
#[derive(Clone, Debug, PartialEq)]
pub struct CaptureLine {
    /// What is captured, by their names.
    pub quantities: Vec<String>,
    /// Time between two readings.
    pub rate: Duration,
    /// How long it is, and when it begins.
    pub span: Span,
    /// TPDOs that are taken although they are in use.
    pub take: Vec<PdoId>,
    /// What has no room in a TPDO is read by SDO.
    pub by_sdo: bool,
}

impl FromStr for CaptureLine {
    type Err = String;

    /// What stands behind `capture`: its [form](CaptureLine::FORM).
    fn from_str(text: &str) -> Result<Self, String> {
        let (mut quantities, mut take, mut rate, mut by_sdo) = (Vec::new(), Vec::new(), RATE, false);
        let (mut duration, mut trigger, mut pre_trigger) = (None, None, Duration::ZERO);
        words::line::take(Self::FORM, text.split_whitespace(), |word, value| {
            match word {
                "for" => duration = Some(some_time(value()?)?),
                "rate" => rate = some_time(value()?)?,
                "trigger" => trigger = Some(value()?.parse::<Trigger>()?),
                "pre" => pre_trigger = some_time(value()?)?,
                "take" => take.push(tpdo_id(value()?)?),
                "sdo" => by_sdo = true,
                // What it is called is known once there is a drive.
                _ => quantities.push(word.to_owned()),
            }
            Ok(true)
        })?;
        let duration = duration.ok_or_else(|| format!("it needs a time, as in: for 2s; expected: {}", Self::FORM))?;
        if quantities.is_empty() {
            return Err(format!("it needs a quantity, such as velocity; expected: {}", Self::FORM));
        }
        Ok(Self { quantities, rate, span: Span { duration, trigger, pre_trigger }, take, by_sdo })
    }
}

impl CaptureLine {
    /// It as a line of a host has it.
    pub const FORM: &str =
        "capture QUANTITY.. for TIME [rate TIME] [trigger QUANTITY>NUMBER] [pre TIME] [take TPDO] [sdo]";

    /// Captures of a virtual drive, and puts everything back.
    ///
    /// # Errors
    /// What cannot be had, and what could not be put back.
    pub async fn carry_out(&self, drive: &Drive, bitrate: Bitrate) -> Result<Taken, Failure> {
        let quantities = measurands(drive, None, &self.quantities).await?;
        let (take, by_sdo) = (self.take.clone(), self.by_sdo);
        let wanted = Wanted { take, by_sdo, ..Wanted::of_a_virtual_drive(quantities, self.rate, bitrate) };
        wanted.check(&self.span)?;
        let restorer = Restorer::of(drive);
        let taken = async { wanted.begin(drive, &restorer).await?.next(&self.span).await }.await;
        both(taken, restorer.restored().await)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_names_what_is_captured_and_how_long() {
        let asked: CaptureLine = "velocity 6041h trigger velocity>10 pre 50ms for 2s rate 2ms".parse().unwrap();
        assert_eq!(asked.quantities, ["velocity", "6041h"]);
        let Span { duration, trigger, pre_trigger } = asked.span;
        assert_eq!((duration.as_millis(), pre_trigger.as_millis(), asked.rate.as_millis()), (2000, 50, 2));
        assert_eq!(trigger, Some(Trigger { quantity: "velocity".into(), level: 10.0, rising: true }));
        for (line, said) in [
            ("velocity", "it needs a time"),
            ("for 2s", "it needs a quantity"),
            ("velocity for", "'for' has no value"),
            ("velocity for 0s", "above 0"),
            ("velocity for 2s trigger fast", "is not a trigger"),
            ("velocity for 2s take rpdo1", "expected tpdo1"),
        ] {
            let refused = line.parse::<CaptureLine>().unwrap_err();
            assert!(refused.contains(said), "{line}: {refused}");
        }
    }
}
