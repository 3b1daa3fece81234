//! `ferrodrive objects MODEL --departures`: where a model departs from CiA 301 and CiA 402, and what to do about it.

use serde::Serialize;

use plot::Paint;
use plot::Table;
use words::models::Description;

/// All departures of a model.
#[derive(Debug, Serialize)]
pub struct DepartureList {
    model: &'static str,
    /// The model, if a node was asked and its model is a guess.
    #[serde(skip_serializing_if = "Option::is_none")]
    guess: Option<&'static str>,
    title: String,
    departures: Vec<DepartureRow>,
}

#[derive(Debug, Serialize)]
struct DepartureRow {
    /// Its name for programs.
    departure: &'static str,
    /// The object that it is about; `None` for what is about none.
    object: Option<String>,
    what: String,
    /// What a program written to the standard has to do.
    remedy: String,
}

impl DepartureList {
    /// Those of `model`.
    pub fn of(model: &'static Description, guess: Option<&'static str>) -> Self {
        let departures = model.departures(devices::all()).map(|departure| DepartureRow {
            departure: departure.key(),
            object: departure.object().map(|object| object.to_string()),
            what: departure.to_string(),
            remedy: departure.remedy().to_string(),
        });
        Self {
            model: model.name,
            guess,
            title: format!("{}, where it departs from CiA 301 and CiA 402", model.title),
            departures: departures.collect(),
        }
    }
}

impl DepartureList {
    /// As lines for people.
    pub fn text(&self, paint: Paint) -> String {
        let mut table = Table::new(&["object", "what is so", "what to do"]);
        for row in &self.departures {
            table.row([row.object.as_deref().unwrap_or("-"), &row.what, &row.remedy]);
        }
        format!("{}\n\n{}", self.title, table.plain(paint))
    }
}
