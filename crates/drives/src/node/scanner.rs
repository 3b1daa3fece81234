use can::Instant;
use canopen::NmtState;
use canopen::od::{Dictionary, Storage, Table};
use canopen::pdo::multiplex::{self, SCANNING_LIST};

use crate::engine::device::Device;

/// Sends the objects of the scanning list (1FA0h to 1FCFh) that change, by the TPDO in source address mode (CiA 301, 7.2.3.2.2): one
/// each time it is called, and in turn.
#[derive(Clone)]
pub(super) struct Scanner<S: Storage> {
    /// The cells as they were sent last; none of a device without a list.
    sent: Option<S::Cells>,
    /// Operational has been entered, and `sent` is what it began with.
    running: bool,
    /// The place in the list behind the one that was sent last.
    next: usize,
}

impl<S: Storage> core::fmt::Debug for Scanner<S> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Scanner").field("running", &self.running).field("next", &self.next).finish_non_exhaustive()
    }
}

impl<S: Storage> Scanner<S> {
    pub(super) const NONE: Self = Self { sent: None, running: false, next: 0 };

    pub(super) fn of(table: &Table) -> Self {
        let rows = table.rows();
        let has_list = rows.iter().any(|row| SCANNING_LIST.contains(&row.index));
        Self { sent: has_list.then(|| S::cells(rows.len())), ..Self::NONE }
    }

    /// Once each run of the communication task.
    pub(super) fn run(&mut self, device: &mut Device<impl Storage>, now: Instant) {
        let Some(sent) = &mut self.sent else { return };
        let operational = device.node().state() == NmtState::Operational;
        if !core::mem::replace(&mut self.running, operational) || !operational {
            // What it begins with does not count as a change.
            for (slot, _) in device.values().table().iter() {
                sent.as_mut()[slot.position()] = device.values().raw(slot);
            }
            return;
        }
        if let Some((place, position, raw)) = changed::<S>(device.values(), sent, self.next)
            && let Some((slot, _)) = device.values().table().iter().find(|(slot, _)| slot.position() == position)
            && device.send_by_source(slot, now)
        {
            sent.as_mut()[position] = raw;
            self.next = place + 1;
        }
    }
}

/// The next object of the list from `next` on, and then from its begin, that has changed: its place in the list, that of its row, and
/// its cell. What cannot be mapped into a TPDO, or has more than four bytes, is passed over.
fn changed<S: Storage>(values: &Dictionary<impl Storage>, sent: &S::Cells, next: usize) -> Option<(usize, usize, u32)> {
    let view = values.view();
    let find = |from: usize| {
        multiplex::scanned(&view).enumerate().skip(from).find_map(|(place, object)| {
            let slot = values.table().find(object).ok()?;
            let row = values.table().row(slot);
            let (raw, position) = (values.raw(slot), slot.position());
            let can = row.data_type.fits_cell() && row.access.is_readable() && row.pdo.is_transmittable();
            (can && raw != sent.as_ref()[position]).then_some((place, position, raw))
        })
    };
    find(next).or_else(|| find(0))
}
