//! The data sheet of every model against a fresh drive of it on the bus: a tool that writes only what differs from the sheet
//! breaks a network in silence if the sheet says a default that the drive does not have.

use std::time::Duration;

use canopen::od::DataType;
use canopen::{Mux, NodeId};
use devices::Description;
use devices::variant::Variation;
use eds::{Eds, Sheet, Value, Variable, write};
use master::{Network, Node};
use sim::World;
use sim::machine::{Order, models, order};

/// Asks a fresh drive of the model.
fn ask<T>(model: &'static Description, order_of: &Order, question: impl AsyncFnOnce(Node) -> T) -> T {
    let mut world = World::new(order_of.bitrate, 1);
    let drive = order(model, order_of).expect("a drive of this model");
    world.add_drive(order_of.node.raw(), drive).expect("a free place");
    let network = Network::new();
    world.add_station(network.clone());
    world.run_for(Duration::from_secs(1));
    sim::block_on(&mut world, question(network.node(order_of.node))).expect("the drive answers")
}

fn sheet(of: &Sheet<'_>) -> Eds {
    Eds::load(write(&of.eds()).as_bytes()).expect("a sheet can be read").eds
}

/// The bytes of an SDO for the default that the sheet says.
fn bytes(variable: &Variable, node: NodeId) -> Option<Vec<u8>> {
    let size = DataType::from_code(variable.data_type.0)?.size();
    match variable.default.as_ref()? {
        Value::Number(number) => Some(number.at_node(node.raw()).to_le_bytes()[..size].to_vec()),
        Value::Real(_) => None,
        Value::Text(text) => Some(text.as_bytes().to_vec()),
    }
}

/// Each default of the sheet that is not what the drive says; and how many were compared.
async fn differing(eds: Eds, node: Node) -> (usize, Vec<String>) {
    let (mut compared, mut wrong) = (0, Vec::new());
    for (index, variable) in eds.variables().filter(|(_, variable)| variable.access.is_readable()) {
        let Some(expected) = bytes(variable, node.id()) else { continue };
        compared += 1;
        let place = Mux::new(index, variable.sub_index);
        match node.upload(place).await {
            // Sub-index 0 is UNSIGNED8 in the sheet, whatever the drive sends.
            Ok(said) if said.as_bytes().get(..expected.len()) == Some(&expected[..]) => {}
            Ok(said) => wrong.push(format!("{place} is {:02X?}, in the sheet {expected:02X?}", said.as_bytes())),
            Err(error) => wrong.push(error.to_string()),
        }
    }
    (compared, wrong)
}

/// Every model as delivered, and with each choice that comes with other objects: the model, its order and its sheet.
fn delivered() -> impl Iterator<Item = (&'static Description, Order, Eds)> {
    let choices = |variation: &'static Variation| variation.choices.iter().map(|choice| (variation.key, choice.name));
    let firmwares = move |model: &'static Description| {
        let other = model.variations.iter().filter(|variation| variation.key == "firmware").flat_map(choices);
        let other: Vec<_> = other.skip(1).map(Some).collect();
        [None].into_iter().chain(other).map(move |firmware| {
            let node = model.node_id.unwrap_or(NodeId::MIN);
            let mut wanted = Order::new(model, node, model.bitrate.unwrap_or(can::Bitrate::K500));
            firmware.into_iter().for_each(|(key, choice)| wanted.variant.choose(key, choice).expect("a choice"));
            let chosen = model.as_chosen(&wanted.variant);
            assert_eq!(std::ptr::eq(chosen, model), firmware.is_none(), "{}: {firmware:?}", model.name);
            (model, wanted, sheet(&Sheet::of(chosen)))
        })
    };
    models().flat_map(firmwares)
}

#[test]
fn every_default_of_a_sheet_is_what_a_fresh_drive_answers() {
    let (mut all, mut count) = (0, 0);
    for (model, order, eds) in delivered() {
        let (compared, wrong) = ask(model, &order, async |node| differing(eds, node).await);
        assert_eq!(wrong, Vec::<String>::new(), "{}", model.name);
        assert!(compared > 0, "{}", model.name);
        (all, count) = (all + compared, count + 1);
    }
    // A small drive has few of them; the tables as a whole have many.
    assert!(all > 60 * count, "{all} of {count}");
}

#[test]
fn every_object_of_a_sheet_is_there_and_no_other() {
    for (model, order, eds) in delivered() {
        let places: Vec<Mux> = eds.variables().map(|(index, variable)| Mux::new(index, variable.sub_index)).collect();
        let rows: Vec<Mux> =
            model.as_chosen(&order.variant).dictionary.rows().iter().map(canopen::od::Entry::mux).collect();
        assert_eq!(places, rows, "{}", model.name);
        let readable = eds.variables().filter(|(_, variable)| variable.access.is_readable());
        let readable: Vec<Mux> = readable.map(|(index, variable)| Mux::new(index, variable.sub_index)).collect();
        let refused = ask(model, &order, async |node| {
            let mut refused = Vec::new();
            for place in readable {
                if let Err(error) = node.upload(place).await {
                    refused.push(error.to_string());
                }
            }
            refused
        });
        assert_eq!(refused, Vec::<String>::new(), "{}", model.name);
    }
}

#[test]
fn the_choices_of_a_drive_are_in_its_sheet_and_in_the_drive() {
    let model = devices::model("zlac8030l").expect("a model");
    let mut of = Sheet::of(model);
    of.variant.choose("defaults", "eds").expect("a choice of this model");
    let node = NodeId::new(4).expect("a node-ID");
    let mut chosen = Order::new(model, node, can::Bitrate::K500);
    chosen.variant = of.variant;
    let (compared, wrong) = ask(model, &chosen, async |node| differing(sheet(&of), node).await);
    assert_eq!(wrong, Vec::<String>::new());
    assert!(compared > 60, "{compared} defaults");
    // The sheet of a drive without the choice says other defaults, and the test sees it.
    let (_, wrong) = ask(model, &chosen, async |node| differing(sheet(&Sheet::of(model)), node).await);
    assert!(wrong.iter().any(|what| what.starts_with("2014h:00")), "{wrong:?}");
}
