//! `ferrodrive watch`: objects of a node, read again and again.

use std::time::Duration;

use canopen::od::Entry;
use canopen::{AbortCode, Mux, NodeId};
use master::decode::{common_name, common_row};
use master::{Drive, Error};
use serde::Serialize;

use crate::command::repeat::{Repeat, Ticker, period};
use crate::context::Context;
use crate::failure::Failure;
use crate::output::{Format, Report};
use crate::progress::Screen;
use console::command::object::resolve;
use console::numbers::whole;
use plot::Paint;
use plot::Table;
use words::decode::{Decoded, decode};
use words::node::node;
use words::object::{ObjectArg, object};
use words::time::some_time;

/// Show objects of a node as they change: a live table on a terminal, lines elsewhere
///
/// Its requests are signs of life too: a drive that stops when its host falls silent (2000h of a ZLAC8030L) does not
/// stop while it is watched.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus socketcand://HOST:29536/can0 watch 4 6064 606C statusword\n  \
    ferrodrive watch 4 2026:01 --every 1s --count 60 --json > motor.jsonl")]
pub(crate) struct Watch {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// Indices, index:sub-index or names
    #[arg(value_name = "OBJECT", required = true, value_parser = object)]
    objects: Vec<ObjectArg>,
    /// Time between two readings
    #[arg(long, value_name = "TIME", value_parser = period, default_value = "100ms")]
    every: Duration,
    /// Number of readings (default: until Ctrl-C)
    #[arg(long, value_name = "N", value_parser = |text: &str| whole(text, 1..=u64::MAX))]
    count: Option<u64>,
    /// End after this time
    #[arg(long = "for", value_name = "TIME", value_parser = some_time, conflicts_with = "count")]
    duration: Option<Duration>,
}

/// One look.
#[derive(Debug, Serialize)]
struct WatchedLook {
    t: f64,
    node: u8,
    values: Vec<SeenValue>,
}

/// What an object had at one look.
#[derive(Clone, Debug, Serialize)]
struct SeenValue {
    object: String,
    name: Option<&'static str>,
    #[serde(flatten)]
    value: Option<Decoded>,
    /// Why there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
}

/// An object that is watched.
struct Watched {
    mux: Mux,
    name: Option<&'static str>,
    row: Option<&'static Entry>,
    counts_per_unit: i64,
    /// The smallest and the largest number so far, with what they print as.
    lowest: Option<(i64, String)>,
    highest: Option<(i64, String)>,
}

impl Watch {
    /// Looks again and again.
    pub(crate) async fn run(&self, context: &Context, format: Format) -> Result<(), Failure> {
        let drive = context.drive(self.node).await?;
        let mut watched = Vec::new();
        for object in &self.objects {
            watched.push(Watched::new(&drive, object).await?);
        }
        let repeat = Repeat { every: Some(self.every), count: self.count };
        let times = if self.duration.is_some() { None } else { repeat.times(context)? };
        let mut screen = (!format.json).then(Screen::on_terminal).flatten();
        if screen.is_some() {
            // One of the two draws on the terminal.
            context.progress.clear();
        }
        let looks = async {
            let mut pace = Ticker::new(&context.network, self.every);
            let mut looks = 0;
            while times.is_none_or(|times| looks < times) {
                pace.wait().await;
                let look = self.look(context, &drive, &watched, looks == 0).await?;
                watched.iter_mut().zip(&look.values).for_each(|(watched, seen)| watched.note(seen));
                match &mut screen {
                    Some(screen) => screen.show(&table(&watched, &look, format.paint)),
                    None => format.print(&look).map_err(Failure::of_stdout)?,
                }
                looks += 1;
            }
            Ok(())
        };
        match self.duration {
            Some(duration) => context.listen_for(Some(duration), duration, looks).await,
            None => looks.await,
        }
    }

    /// Reads every object once. What is missing for good ends the command at its first look, silence does not later on.
    async fn look(
        &self,
        context: &Context,
        drive: &Drive,
        watched: &[Watched],
        first: bool,
    ) -> Result<WatchedLook, Failure> {
        let mut values = Vec::with_capacity(watched.len());
        let t = context.network.now().as_secs_f64();
        for object in watched {
            let seen = match drive.node().upload(object.mux).await {
                Ok(payload) => object.seen(drive, payload.as_bytes()),
                Err(error) if first => return Err(error.into()),
                Err(error) => object.unseen(&error),
            };
            values.push(seen);
        }
        Ok(WatchedLook { t, node: self.node.raw(), values })
    }
}

impl Watched {
    async fn new(drive: &Drive, object: &ObjectArg) -> Result<Self, Failure> {
        let model = drive.description();
        let (mux, row) = resolve(drive, object)?;
        let row = if model.is_some() { row } else { common_row(mux) };
        let name = row.map(|row| row.name).or_else(|| common_name(mux).filter(|_| model.is_none()));
        let counts_per_unit = match row.filter(|row| model.is_some() && row.resolution.is_some()) {
            Some(_) => drive.limits(mux).await?.counts_per_unit(),
            None => 1,
        };
        Ok(Self { mux, name, row, counts_per_unit, lowest: None, highest: None })
    }

    fn seen(&self, drive: &Drive, bytes: &[u8]) -> SeenValue {
        let value = decode(drive.description(), self.row, bytes).at_resolution(self.counts_per_unit);
        SeenValue { value: Some(value), ..self.blank() }
    }

    fn unseen(&self, error: &Error) -> SeenValue {
        let why = match error {
            Error::NoAnswer { .. } => "no answer".to_owned(),
            Error::Aborted { code: AbortCode(code), .. } => format!("refused: {}", AbortCode(*code)),
            other => other.to_string(),
        };
        SeenValue { error: Some(why), ..self.blank() }
    }

    fn blank(&self) -> SeenValue {
        SeenValue { object: self.mux.to_string(), name: self.name, value: None, error: None }
    }

    /// Keeps the extremes of what is measured; of states and texts there are none.
    fn note(&mut self, seen: &SeenValue) {
        let Some(value) = seen.value.as_ref().filter(|value| value.quantity.is_some() && value.meaning.is_none())
        else {
            return;
        };
        let Some(number) = value.value else { return };
        let shown = || (number, value.text(Paint::OFF));
        if self.lowest.as_ref().is_none_or(|(lowest, _)| number < *lowest) {
            self.lowest = Some(shown());
        }
        if self.highest.as_ref().is_none_or(|(highest, _)| number > *highest) {
            self.highest = Some(shown());
        }
    }
}

impl SeenValue {
    fn text(&self, paint: Paint) -> String {
        match (&self.value, &self.error) {
            (Some(value), _) => value.text(paint),
            (None, Some(error)) => paint.bad(error),
            (None, None) => String::new(),
        }
    }
}

fn table(watched: &[Watched], look: &WatchedLook, paint: Paint) -> String {
    let mut table = Table::new(&["object", "name", "value", "lowest", "highest"]);
    for (object, seen) in watched.iter().zip(&look.values) {
        let extreme =
            |extreme: &Option<(i64, String)>| extreme.as_ref().map_or_else(String::new, |(_, text)| text.clone());
        table.row([
            seen.object.clone(),
            seen.name.unwrap_or_default().to_owned(),
            seen.text(Paint::OFF),
            extreme(&object.lowest),
            extreme(&object.highest),
        ]);
    }
    let heading = format!("node {} at {:.1} s; Ctrl-C ends it", look.node, look.t);
    // The values stay; the extremes are on a wide screen alone.
    let table = table.narrowed(Screen::width(), 3);
    format!("{}\n{}", paint.dim(&heading), table.plain(paint))
}

impl Report for WatchedLook {
    fn text(&self, paint: Paint) -> String {
        let values = self.values.iter().map(|seen| {
            let name = seen.name.unwrap_or(&seen.object);
            format!("{name} = {}", seen.text(paint))
        });
        format!("{} {}", paint.dim(&format!("({:.6})", self.t)), values.collect::<Vec<_>>().join(", "))
    }
}
