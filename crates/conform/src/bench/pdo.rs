//! PDOs as cases set them up: off, changed, on again (CiA 301, 7.5.2.36 and 7.5.2.38).

use can::{BusFrame, CanId, Frame};
use canopen::od::{DataType, Entry, PdoMapping};
use canopen::pdo::PdoId;
use canopen::{CobId, Mux, connection_set};

use super::{Bench, SdoResult, ms};
use crate::finding::{Finding, not_applicable};
use crate::subject::{bytes_of, number_of};

/// A transmit PDO that a case has set up.
#[derive(Clone, Copy)]
pub(crate) struct Tpdo {
    /// The index of its communication parameter.
    pub(crate) index: u16,
    /// Its identifier.
    pub(crate) id: CanId,
    /// What it carries, if the case chose it.
    pub(crate) mapped: Option<&'static Entry>,
}

impl Bench {
    /// The first transmit PDO, with this transmission type, and an object to carry where the mapping can be changed: one that
    /// a write changes, where there is one.
    pub(crate) async fn set_up_tpdo(&mut self, transmission: u8, timer_ms: u16) -> Result<Tpdo, Finding> {
        let Some(index) = self.subject.pdos(0x1800).next() else { not_applicable!("the device has no transmit PDO") };
        self.hush_sync().await?;
        let id = self.switch_off(index).await?;
        for (sub_index, value) in [(3, 0), (5, timer_ms)] {
            if self.subject.row(index, sub_index).is_some() {
                self.write(Mux::new(index, sub_index), &value.to_le_bytes()).await?;
            } else if value != 0 {
                not_applicable!("the device has no event timer: {index:04X}h:05");
            }
        }
        if let Err(code) = self.try_write(Mux::new(index, 2), &[transmission]).await? {
            not_applicable!("the device does not take transmission type {transmission}: {code}");
        }
        let wanted = self.mappable(PdoMapping::Transmit);
        let mapped = match wanted {
            Some(row) if self.map(index, &[entry(row)]).await?.is_ok() => Some(row),
            _ => None,
        };
        if mapped.is_none() && self.number(Mux::new(index + 0x200, 0)).await? == 0 {
            not_applicable!("nothing can be mapped into the transmit PDO {index:04X}h");
        }
        self.count(id);
        if matches!(transmission, 252 | 253) {
            self.allow_remote_frames(index).await?;
        }
        self.switch_on(index, id).await?;
        self.watch(id);
        Ok(Tpdo { index, id, mapped })
    }

    /// The node produces no SYNC of its own (bit 30 of 1005h) until the case ends: those of the case are meant.
    pub(crate) async fn hush_sync(&mut self) -> Result<(), Finding> {
        let Some(row) = self.subject.row(0x1005, 0).filter(|row| row.access.is_writable()) else { return Ok(()) };
        let cob = self.number(row.mux()).await? as u32;
        if CobId(cob).generates() {
            // A device that refuses goes on, and what it sends shows.
            let _ = self.try_write(row.mux(), &(cob & !CobId::GENERATES).to_le_bytes()).await?;
        }
        Ok(())
    }

    /// Bit 31 of a PDO's COB-ID is set. The identifier that it had, or that it has by the predefined connection set.
    pub(crate) async fn switch_off(&mut self, index: u16) -> Result<CanId, Finding> {
        let cob = self.number(Mux::new(index, 1)).await? as u32;
        let off = (cob | CobId::INVALID).to_le_bytes();
        // A device may refuse this and take the rest.
        let _ = self.try_write(Mux::new(index, 1), &off).await?;
        let predefined = PdoId::of_object(index).and_then(|(pdo, _)| match index {
            0x1400..=0x15FF => connection_set::rpdo(pdo.number, self.node()),
            _ => connection_set::tpdo(pdo.number, self.node()),
        });
        match (cob & 0x7FF, predefined) {
            (0x181..=0x57F, _) => Ok(CanId::standard((cob & 0x7FF) as u16)),
            (_, Some(id)) => Ok(id),
            (_, None) => not_applicable!("the PDO {index:04X}h has no identifier"),
        }
    }

    /// The COB-ID without bit 31, where the object can be written. Bit 30 stays: a device need not have remote frames, and
    /// refuses to clear it then (CiA 301, 7.5.2.37).
    pub(crate) async fn switch_on(&mut self, index: u16, id: CanId) -> Result<(), Finding> {
        let row = self.subject.row(index, 1);
        if row.is_some_and(|row| row.access.is_writable()) {
            let kept = self.number(Mux::new(index, 1)).await? as u32 & CobId::NO_RTR;
            self.write(Mux::new(index, 1), &(id.raw() | kept).to_le_bytes()).await?;
        }
        Ok(())
    }

    /// Bit 30 of a PDO that is off is cleared.
    async fn allow_remote_frames(&mut self, index: u16) -> Result<(), Finding> {
        let cob = self.number(Mux::new(index, 1)).await? as u32;
        if cob & CobId::NO_RTR != 0
            && let Err(code) = self.try_write(Mux::new(index, 1), &(cob & !CobId::NO_RTR).to_le_bytes()).await?
        {
            not_applicable!("the device has no remote frames: bit 30 of {index:04X}h:01 stays set ({code})");
        }
        Ok(())
    }

    /// Maps these entries into the PDO of a communication parameter, which is off.
    pub(crate) async fn map(&mut self, index: u16, entries: &[u32]) -> Result<SdoResult<()>, Finding> {
        let mapping = index + 0x200;
        if let Err(code) = self.try_write(Mux::new(mapping, 0), &[0]).await? {
            return Ok(Err(code));
        }
        for (sub_index, entry) in (1..).zip(entries) {
            if let Err(code) = self.try_write(Mux::new(mapping, sub_index), &entry.to_le_bytes()).await? {
                return Ok(Err(code));
            }
        }
        self.try_write(Mux::new(mapping, 0), &[entries.len() as u8]).await
    }

    /// An object that can be mapped in this direction: a setting that a write changes first.
    pub(crate) fn mappable(&self, direction: PdoMapping) -> Option<&'static Entry> {
        let rows = || self.subject.rows().filter(move |row| is_mappable(row, direction));
        let setting = rows().find(|row| self.subject.is_setting(row) && row.resolution.is_none());
        setting.or_else(|| rows().next())
    }

    /// A setting that can be mapped into a receive PDO.
    pub(crate) fn receivable(&self) -> Option<&'static Entry> {
        let takes = |row: &&Entry| is_mappable(row, PdoMapping::Receive) && row.access.is_readable();
        self.subject.rows().filter(takes).find(|row| self.subject.is_setting(row) && row.resolution.is_none())
    }

    /// Writes another value to a mapped setting. False if there is none.
    pub(crate) async fn change(&mut self, row: &Entry) -> Result<bool, Finding> {
        if !self.subject.is_setting(row) {
            return Ok(false);
        }
        let data = self.read(row.mux()).await?;
        let Some(other) = number_of(row.data_type, &data).and_then(|value| another(row, value)) else {
            return Ok(false);
        };
        Ok(self.try_write(row.mux(), &bytes_of(row.data_type, other)).await?.is_ok())
    }

    /// SYNC, with a counter where one is given, and the frames of a PDO that come within 50 ms.
    pub(crate) async fn sync(&mut self, counter: Option<u8>, id: CanId) -> Vec<BusFrame> {
        self.absorb();
        let sync = match counter {
            Some(counter) => Frame::new(connection_set::SYNC, &[counter]),
            None => Frame::new(connection_set::SYNC, &[]),
        };
        self.send(sync);
        self.collect(ms(50), |frame| frame.id() == id && !frame.is_remote()).await
    }
}

/// A mapping entry of a whole object.
pub(crate) const fn entry(row: &Entry) -> u32 {
    (row.index as u32) << 16 | (row.sub_index as u32) << 8 | row.data_type.bits() as u32
}

/// True if the row says that the object may be mapped in this direction, by its PDO attribute and its access.
pub(crate) fn is_mappable(row: &Entry, direction: PdoMapping) -> bool {
    let plain = row.data_type != DataType::Boolean && matches!(row.data_type.bits(), 8 | 16 | 32);
    let access = match direction {
        PdoMapping::Receive => row.access.is_writable(),
        _ => row.access.is_readable(),
    };
    plain && access && (row.pdo == PdoMapping::Yes || row.pdo == direction) && !row.is_communication()
}

/// Another value that the object takes.
pub(crate) fn another(row: &Entry, value: i64) -> Option<i64> {
    if !row.values.is_empty() {
        return row.values.iter().map(|(listed, _)| *listed).find(|listed| *listed != value);
    }
    let (low, high) = row.integer_limits().unwrap_or_else(|| row.data_type.range());
    [value + 1, value - 1].into_iter().find(|other| (low..=high).contains(other))
}
