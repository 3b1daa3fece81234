use canopen::Mux;

use super::error::SignalError;
use crate::core::{NumberForm, RpdoTrigger, Sample, SetPoint, Signal};
use crate::network::Node;
use canopen::pdo::{Direction, PdoNumber};

/// Finding objects in the process data of a node, once, so that reading and writing them is an index and a shift.
///
/// PDOs are known once they were read from the device ([`Node::adopt_pdo`]) or set up ([`Node::configure_pdo`]); a later
/// mapping of the PDO ends the handles into the old one.
impl Node {
    /// An object that the node sends by TPDO, as a plain number with the sign of `T`. Of several TPDOs that carry it, the one
    /// that was set up first.
    ///
    /// # Errors
    /// [`SignalError`].
    pub fn signal<T: Sample>(&self, mux: Mux) -> Result<Signal<T>, SignalError> {
        self.scaled_signal(mux, None, T::FORM, 1.0)
    }

    /// As [`signal`](Self::signal), from one TPDO only.
    ///
    /// # Errors
    /// [`SignalError`].
    pub fn signal_in<T: Sample>(&self, number: PdoNumber, mux: Mux) -> Result<Signal<T>, SignalError> {
        self.scaled_signal(mux, Some(number), T::FORM, 1.0)
    }

    /// An object that the node takes by RPDO, as a plain number with the sign of `T`. Of several RPDOs that carry it, one
    /// that waits for SYNC, else the one that was set up first.
    ///
    /// # Errors
    /// [`SignalError`].
    pub fn set_point<T: Sample>(&self, mux: Mux) -> Result<SetPoint<T>, SignalError> {
        self.scaled_set_point(mux, T::FORM, 1.0).map(|(_, set_point)| set_point)
    }

    /// As [`set_point`](Self::set_point), in one RPDO only.
    ///
    /// # Errors
    /// [`SignalError`].
    pub fn set_point_in<T: Sample>(&self, number: PdoNumber, mux: Mux) -> Result<SetPoint<T>, SignalError> {
        self.find_set_point(mux, Some(number), T::FORM, 1.0).map(|(_, set_point)| set_point)
    }

    pub(crate) fn scaled_signal<T: Sample>(
        &self,
        mux: Mux,
        number: Option<PdoNumber>,
        form: NumberForm,
        per_count: f64,
    ) -> Result<Signal<T>, SignalError> {
        let place = self.network().look(|core| {
            let mut found = core.image().find_signals(self.id(), mux);
            found.find(|(of, _)| number.is_none_or(|number| number == *of)).map(|(_, place)| place)
        });
        let place = place.ok_or_else(|| self.not_mapped(mux, Direction::Tpdo))?;
        Signal::new(place, form, per_count).ok_or_else(|| self.does_not_suit::<T>(mux, place.bits()))
    }

    /// The handle, and the number of the RPDO that it is in.
    pub(crate) fn scaled_set_point<T: Sample>(
        &self,
        mux: Mux,
        form: NumberForm,
        per_count: f64,
    ) -> Result<(PdoNumber, SetPoint<T>), SignalError> {
        self.find_set_point(mux, None, form, per_count)
    }

    fn find_set_point<T: Sample>(
        &self,
        mux: Mux,
        number: Option<PdoNumber>,
        form: NumberForm,
        per_count: f64,
    ) -> Result<(PdoNumber, SetPoint<T>), SignalError> {
        let found = self.network().look(|core| {
            let all = core.image().find_set_points(self.id(), mux);
            let all = all.filter(|(of, ..)| number.is_none_or(|number| number == *of));
            // The first of the least.
            all.min_by_key(|(_, trigger, _)| *trigger != RpdoTrigger::Sync).map(|(number, _, place)| (number, place))
        });
        let (number, place) = found.ok_or_else(|| self.not_mapped(mux, Direction::Rpdo))?;
        let set_point = SetPoint::new(place, form, per_count);
        set_point.map(|it| (number, it)).ok_or_else(|| self.does_not_suit::<T>(mux, place.bits()))
    }

    fn not_mapped(&self, mux: Mux, direction: Direction) -> SignalError {
        let mapped = self.network().look(|core| core.image().carried(self.id(), direction == Direction::Rpdo));
        SignalError::NotMapped { node: self.id(), mux, direction, mapped }
    }

    fn does_not_suit<T>(&self, mux: Mux, bits: u32) -> SignalError {
        SignalError::DoesNotSuit { node: self.id(), mux, bits, wanted: core::any::type_name::<T>() }
    }
}
