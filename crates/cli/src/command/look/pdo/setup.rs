//! `ferrodrive pdo plan` and `pdo apply`: PDOs set up in words, as a transaction.

use std::collections::BTreeMap;
use std::time::Duration;

use can::Bitrate;
use canopen::pdo::PdoId;
use canopen::{CobId, Mux, NodeId};
use devices::{Description, Timing};
use host::network::params::source::MACHINE_FILE;
use machine::file::{mapped, pdo_id};
use master::Drive;
use master::core::PdoMap;
use master::parameters::Parameters;
use master::pdo::{PdoConfig, TransmissionType, values_off};
use master::plan::{NodeTraffic, Settings, plan};
use master::units::parse_duration;
use serde::Serialize;
use words::node::node;

use crate::command::configure::params::{PlanReport, Transaction, plan_of};
use crate::command::repeat::period;
use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use console::numbers::whole;
use plot::Paint;
use plot::Table;

/// What is to be configured.
#[derive(Debug, clap::Args)]
pub(super) struct WantedPdos {
    /// Node-ID
    #[arg(value_parser = node)]
    pub(super) node: NodeId,
    /// A PDO and its objects by name or number, or `off`: tpdo1=statusword,6064 (default: those of the machine file)
    #[arg(value_name = "PDO=OBJECTS", value_parser = asked)]
    pdos: Vec<AskedPdo>,
    /// Transmission type of the named PDOs: 1 with every SYNC, 255 on events (CiA 301, tables 66 and 71)
    #[arg(long = "type", value_name = "0-255", requires = "pdos", value_parser = |text: &str| whole(text, 0..=u8::MAX))]
    transmission: Option<u8>,
    /// Shortest time between two PDOs (inhibit time)
    #[arg(long, value_name = "TIME", value_parser = parse_duration, requires = "pdos")]
    inhibit: Option<Duration>,
    /// Longest time between two PDOs (event timer)
    #[arg(long, value_name = "TIME", value_parser = parse_duration, requires = "pdos")]
    event: Option<Duration>,
    /// Identifier, if one PDO is named: 0x185
    #[arg(long, value_name = "ID", value_parser = identifier, requires = "pdos")]
    id: Option<u16>,
}

/// Show what `pdo apply` would write, the bits of each PDO, and the bus load before and after
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive pdo plan 4 tpdo1=statusword,position_actual_value --type 1\n  \
    ferrodrive --bus can0 --machine machine.toml pdo plan 4")]
pub(super) struct PlanPdos {
    #[command(flatten)]
    wanted: WantedPdos,
    /// Period of SYNC for which the bus load is calculated
    #[arg(long, value_name = "TIME", value_parser = period, default_value = "10ms")]
    cycle: Duration,
    /// Bit rate for which the bus load is calculated
    #[arg(long, value_name = "RATE", default_value = "500k")]
    bitrate: Bitrate,
}

/// Configure PDOs of a node, all or none, in the order of CiA 301
///
/// As with `params apply`, each value is read back, everything is put back on the first refusal, and a journal restores
/// the node after a kill (`ferrodrive params rollback`).
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive pdo apply 4 tpdo1=statusword,6064 tpdo2=off --type 1 --save\n  \
    ferrodrive --bus can0 --machine machine.toml pdo apply 4")]
pub(super) struct ApplyPdos {
    #[command(flatten)]
    wanted: WantedPdos,
    #[command(flatten)]
    how: Transaction,
}

#[derive(Clone, Debug)]
struct AskedPdo {
    pdo: PdoId,
    /// `None`: off.
    objects: Option<Vec<String>>,
}

fn asked(text: &str) -> Result<AskedPdo, String> {
    let (pdo, objects) = text
        .split_once('=')
        .ok_or("expected a PDO and its objects, e.g. tpdo1=statusword,position_actual_value, or tpdo2=off")?;
    let objects = (objects != "off").then(|| objects.split(',').map(|name| name.trim().to_owned()).collect());
    Ok(AskedPdo { pdo: pdo_id(pdo)?, objects })
}

fn identifier(text: &str) -> Result<u16, String> {
    let digits = text.strip_prefix("0x").unwrap_or(text);
    let id = u16::from_str_radix(digits, 16).ok().filter(|id| *id <= 0x7FF);
    let id = id.ok_or_else(|| format!("expected an identifier of 11 bits, 0x181 to 0x77F, got '{text}'"))?;
    CobId::standard(id)
        .check_identifier()
        .map(|()| id)
        .map_err(|_| format!("{id:03X}h is reserved for another service (CiA 301, table 41)"))
}

/// Bits of a PDO as it would be.
#[derive(Debug, Serialize)]
struct Budget {
    pdo: String,
    bits: u32,
    when: String,
    objects: Vec<String>,
}

/// What would be written, and what results from it.
#[derive(Debug, Serialize)]
pub(super) struct PdoPlanReport {
    pdos: Vec<Budget>,
    /// Share of the bus's time that this node's process data and its heartbeat take, as it is and as it would be.
    load_before: f64,
    load_after: f64,
    bitrate: u32,
    cycle_us: f64,
    #[serde(flatten)]
    plan: PlanReport,
}

impl WantedPdos {
    /// The values of the objects of these PDOs in a model.
    fn parameters(&self, context: &Context, model: &'static Description) -> Result<(Parameters, String), Failure> {
        let node = self.node;
        if self.pdos.is_empty() {
            let of_machine = context.machine.as_ref().and_then(|machine| machine.parameters(node));
            let mut parameters = of_machine.unwrap_or_default();
            parameters.values.retain(|object, _| PdoId::of_object(object.index).is_some());
            if parameters.values.is_empty() {
                return Err(Failure::usage("expected the PDOs to configure")
                    .next(format!(
                        "name them, e.g. ferrodrive pdo plan {node} tpdo1=statusword,position_actual_value --type 1"
                    ))
                    .next("or give a machine file whose [[drive]] has pdos: --machine FILE.toml"));
            }
            return Ok((parameters, MACHINE_FILE.to_owned()));
        }
        if self.id.is_some() && self.pdos.len() > 1 {
            return Err(Failure::usage("--id takes one PDO: two with the same identifier would disturb each other")
                .next("name one PDO with it, or omit --id: each PDO keeps its identifier"));
        }
        let mut values: BTreeMap<Mux, Vec<u8>> = BTreeMap::new();
        for asked in &self.pdos {
            let refused = |reason: String| {
                let advice = format!(
                    "ferrodrive objects {node} WORD shows objects, ferrodrive pdo show {node} the PDOs and what they carry"
                );
                Failure::usage(reason).at_node(node).next(advice)
            };
            let of_pdo = match &asked.objects {
                None => values_off(model, asked.pdo, node),
                Some(names) => {
                    let records = names.iter().map(|name| mapped(model, asked.pdo, name)).collect::<Result<_, _>>();
                    let mut config = PdoConfig::new(asked.pdo, PdoMap(records.map_err(refused)?));
                    config.transmission = self.transmission.map_or(config.transmission, TransmissionType);
                    config.inhibit_time = self.inhibit;
                    config.event_time = self.event;
                    config.id = self.id;
                    config.values(model, node)
                }
            };
            for (object, value) in of_pdo.map_err(|error| refused(error.to_string()))? {
                if values.insert(object, value).is_some() {
                    return Err(refused(format!("{} is named twice", asked.pdo)));
                }
            }
        }
        Ok((Parameters { node: Some(node), values, ..Parameters::default() }, "the command line".to_owned()))
    }
}

impl PlanPdos {
    pub(super) async fn run(&self, context: &Context) -> Result<PdoPlanReport, Failure> {
        let drive = context.known_drive(self.wanted.node).await?;
        let model = drive.description().ok_or_else(|| Failure::unknown_model(self.wanted.node))?;
        let (wanted, from) = self.wanted.parameters(context, model)?;
        let before = drive.pdos().await?;
        let after = before.iter().map(|(config, cob_id)| config.with_values(*cob_id, &wanted.values, model));
        let after = after.collect::<Vec<_>>();
        let touched = |pdo: PdoId| {
            wanted.values.keys().any(|object| PdoId::of_object(object.index).map(|(id, _)| id) == Some(pdo))
        };
        let budgets = after.iter().filter(|(config, _)| touched(config.pdo)).map(|(config, cob_id)| Budget {
            pdo: config.pdo.to_string(),
            bits: config.map.bits(),
            when: if cob_id.is_valid() { config.when() } else { "off".to_owned() },
            objects: config.map.0.iter().map(|record| named(model, record.mux)).collect(),
        });
        let pdos = budgets.collect();
        let load = |pdos: Vec<(PdoConfig, CobId)>| self.load(&drive, model, pdos);
        let (load_before, load_after) = (load(before), load(after));
        let plan = plan_of(&context.progress, &drive, &wanted, from, false).await?;
        let (bitrate, cycle_us) = (self.bitrate.bits_per_second(), self.cycle.as_secs_f64() * 1e6);
        Ok(PdoPlanReport { pdos, load_before, load_after, bitrate, cycle_us, plan })
    }

    fn load(&self, drive: &Drive, model: &Description, pdos: Vec<(PdoConfig, CobId)>) -> f64 {
        let timing: Timing = model.timing;
        let event_trigger = model.pdo.event_trigger;
        let node = drive.node().id();
        let emcy = model.sends_emcy();
        let traffic = NodeTraffic { node, pdos, in_cycle: None, event_trigger, heartbeat: None, emcy, timing };
        let settings = Settings { sdo: None, emcy: None, nmt: None, ..Settings::new(self.cycle) };
        let load = plan(&[traffic], &settings, self.bitrate).load;
        (load * 1e4).round() / 1e4
    }
}

impl ApplyPdos {
    pub(super) async fn run(&self, context: &Context) -> Result<impl Report + use<>, Failure> {
        let drive = context.known_drive(self.wanted.node).await?;
        let model = drive.description().ok_or_else(|| Failure::unknown_model(self.wanted.node))?;
        let (wanted, from) = self.wanted.parameters(context, model)?;
        self.how.run(context, &drive, &wanted, from).await
    }
}

fn named(model: &'static Description, object: Mux) -> String {
    model.row(object).map_or_else(|| object.to_string(), |row| row.name.to_owned())
}

impl Report for PdoPlanReport {
    fn text(&self, paint: Paint) -> String {
        let mut table = Table::new(&["pdo", "bits of 64", "when", "carries"]);
        for budget in &self.pdos {
            let objects = budget.objects.join(", ");
            table.row([budget.pdo.clone(), budget.bits.to_string(), budget.when.clone(), objects]);
        }
        format!(
            "{}\n\n{}\n\nload of the bus by this node's PDOs and SYNC: {:.1} % now, {:.1} % then, at {} kbit/s and a cycle of {} ms",
            table.plain(paint),
            self.plan.text(paint),
            100.0 * self.load_before,
            100.0 * self.load_after,
            self.bitrate / 1_000,
            self.cycle_us / 1e3
        )
    }
}
