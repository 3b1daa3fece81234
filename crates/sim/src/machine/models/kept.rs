//! How described devices communicate, kept for the life of the program: firmware holds references.

use std::collections::HashMap;
use std::sync::{LazyLock, Mutex, PoisonError};

use canopen::node::NodeProfile;
use canopen::od::{Condition, Conditions, Slot};
use devices::Description;
use drives::communication::communication;

/// By the address of the description: descriptions are kept themselves, and two at one address are the same.
static PROFILES: LazyLock<Mutex<HashMap<usize, &'static NodeProfile>>> = LazyLock::new(Mutex::default);

/// The profile of a description, with these conditions on its downloads. Made once for each description.
pub(super) fn profile(
    model: &'static Description,
    conditions: impl Iterator<Item = (Slot, Condition)>,
) -> &'static NodeProfile {
    let mut kept = PROFILES.lock().unwrap_or_else(PoisonError::into_inner);
    kept.entry(std::ptr::from_ref(model).addr()).or_insert_with(|| {
        let conditions = keep(conditions.collect(), model.dictionary.rows().len());
        Box::leak(Box::new(NodeProfile { conditions, acts_on: drives::node::acts_on, ..communication(model) }))
    })
}

fn keep(list: Vec<(Slot, Condition)>, rows: usize) -> &'static Conditions {
    let mut numbers = vec![0; rows];
    // A table has no more rows than there are numbers.
    for ((slot, _), number) in list.iter().zip(1..=u16::MAX) {
        numbers[slot.position()] = number;
    }
    Box::leak(Box::new(Conditions::new(list.leak(), numbers.leak())))
}
