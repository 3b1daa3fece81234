//! Which machine is built for which description. Which there are says [`devices::all`].

use can::Instant;
use devices::servo::CIA402;
use devices::zltech::{ZLAC8030L, ZLIM42C, ZLIM42C_82};
use devices::{Description, mjoint};

use super::order::{Order, OrderError};
use crate::VirtualDrive;

/// Builds a machine, without power.
type Maker = fn(&'static Description, &Order) -> Result<Box<dyn VirtualDrive>, OrderError>;

static MACHINES: [(&Description, Maker); devices::all().count()] = [
    (&ZLAC8030L, super::zlac8030l::ordered),
    (&mjoint::M4230E17B50, super::mjoint::ordered),
    (&mjoint::M4230E17B80, super::mjoint::ordered),
    (&mjoint::M8025E25B50, super::mjoint::ordered),
    (&mjoint::M8025E25B80, super::mjoint::ordered),
    (&ZLIM42C, super::zlim42c::ordered),
    (&ZLIM42C_82, super::zlim42c::ordered_82),
    (&CIA402, super::servo::ordered),
];

/// The models that can be simulated: all that are described.
pub fn models() -> impl ExactSizeIterator<Item = &'static Description> + Clone {
    devices::all().iter()
}

/// True for the models that have a machine of their own, which [`models`] lists.
pub fn is_built_in(model: &Description) -> bool {
    models().any(|known| std::ptr::eq(known, model))
}

/// A virtual drive of `model`, without power. One that is not among [`models`], but read from a file, is the generic servo if
/// it has an axis, and else a node with its objects.
///
/// # Errors
/// [`OrderError`] says what the model cannot be.
pub fn order(model: &'static Description, order: &Order) -> Result<Box<dyn VirtualDrive>, OrderError> {
    let machine = MACHINES.iter().find(|(known, _)| std::ptr::eq(*known, model));
    let make = match machine {
        Some((_, make)) => *make,
        None if model.axes.is_empty() => super::node::ordered,
        None => super::servo::ordered,
    };
    let mut drive = make(model, order)?;
    drive.set_fidelity(order.fidelity, Instant::ZERO)?;
    Ok(drive)
}

#[cfg(test)]
mod tests {
    use super::*;
    use can::Bitrate;
    use canopen::NodeId;
    use devices::variant::Preset;

    fn node(raw: u8) -> NodeId {
        NodeId::new(raw).unwrap()
    }

    #[test]
    fn every_model_that_is_described_can_be_had() {
        for model in devices::all().iter() {
            let machines = MACHINES.iter().filter(|(known, _)| std::ptr::eq(*known, model)).count();
            assert_eq!(machines, 1, "{}", model.name);
            let order = order(model, &Order::new(model, node(33), Bitrate::K500));
            let drive =
                order.map(|drive| (drive.model(), drive.description().is_some_and(|of| of.is_edition_of(model))));
            assert_eq!(drive, Ok((model.name, true)));
        }
    }

    #[test]
    fn a_bit_rate_that_the_drive_does_not_know_is_refused_with_those_it_knows() {
        let wanted = |bitrate| order(&ZLAC8030L, &Order::new(&ZLAC8030L, node(4), bitrate));
        assert!(wanted(Bitrate::K125).is_ok());
        let refusal = wanted(Bitrate::K50).err().unwrap().to_string();
        assert!(refusal.contains("cannot run at 50k") && refusal.contains("100 kbit/s"), "{refusal}");
    }

    #[test]
    fn a_node_id_that_the_switches_do_not_have_is_refused() {
        let wanted = |raw| order(&ZLIM42C, &Order::new(&ZLIM42C, node(raw), Bitrate::K500));
        assert!(wanted(15).is_ok() && wanted(32).is_ok());
        assert!(matches!(wanted(16), Err(OrderError::Node { .. })));
    }

    #[test]
    fn a_preset_that_the_drive_would_not_keep_is_refused_with_the_reason() {
        let with = |preset| Order { presets: vec![preset], ..Order::new(&ZLAC8030L, node(4), Bitrate::K500) };
        let refusal = |preset| order(&ZLAC8030L, &with(preset)).err().unwrap().to_string();
        // 2014h, rated current, is RW/S; 60FFh, target velocity, is RW.
        assert!(order(&ZLAC8030L, &with(Preset::new(0x2014, 0, 100))).is_ok());
        assert!(refusal(Preset::new(0x60FF, 0, 10)).contains("does not store"));
        assert!(refusal(Preset::new(0x5000, 0, 10)).contains("no such object"));
        assert!(refusal(Preset::new(0x200E, 0, 77)).contains("0609 0030"));
    }
}
