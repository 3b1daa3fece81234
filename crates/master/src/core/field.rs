//! The bits of an object in a PDO (CiA 301, 7.5.2.36): which PDO, from which bit on, how they are read as a number.

use core::marker::PhantomData;
use core::ops::Range;

use crate::units::{Amperes, Celsius, Rpm, Turns, Volts};

/// Where an object lies in the process image. Good until the PDO gets another mapping: then it finds nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ImagePlace {
    pub(super) slot: u16,
    pub(super) generation: u16,
    pub(super) shift: u8,
    pub(super) mask: u64,
}

impl ImagePlace {
    /// The bits of a frame's data at this place.
    #[inline]
    pub(super) const fn of(&self, data: u64) -> u64 {
        data >> self.shift & self.mask
    }

    /// The data with other bits at this place.
    #[inline]
    pub(super) const fn put(&self, data: u64, raw: u64) -> u64 {
        data & !(self.mask << self.shift) | (raw & self.mask) << self.shift
    }

    /// How many bits it has.
    pub(crate) const fn bits(&self) -> u32 {
        self.mask.count_ones()
    }
}

/// As many low bits set as the range has.
pub(super) const fn mask_of(bits: &Range<u32>) -> u64 {
    let length = bits.end - bits.start;
    if length >= u64::BITS { u64::MAX } else { (1 << length) - 1 }
}

/// These bits of a frame's data.
pub(crate) const fn bits_of(data: u64, bits: Range<u32>) -> u64 {
    data >> bits.start & mask_of(&bits)
}

/// How the bits of an object are a number. Source: CiA 301, 7.1.4.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NumberForm {
    /// BOOLEAN and UNSIGNEDn.
    Unsigned,
    /// INTEGERn, two's complement.
    Signed,
    /// REAL32 and REAL64.
    Real,
}

/// An object's bits, how they are a number, and what one count of it is worth.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// How many bits there are, 1 to 64.
    pub bits: u32,
    /// How they are a number.
    pub form: NumberForm,
    /// Physical units in one count; 1 for a plain number.
    pub per_count: f64,
}

impl Field {
    /// Two's complement of this many bits.
    const fn sign_extended(&self, raw: u64) -> i64 {
        let unused = u64::BITS - self.bits;
        (raw << unused) as i64 >> unused
    }

    fn number(&self, raw: u64) -> f64 {
        match (self.form, self.bits) {
            (NumberForm::Unsigned, _) => raw as f64,
            (NumberForm::Signed, _) => self.sign_extended(raw) as f64,
            (NumberForm::Real, 32) => f64::from(f32::from_bits(raw as u32)),
            (NumberForm::Real, _) => f64::from_bits(raw),
        }
    }

    /// The nearest count as bits; `None` if they cannot hold it.
    fn raw_of(&self, number: f64) -> Option<u64> {
        if !number.is_finite() {
            return None;
        }
        match (self.form, self.bits) {
            (NumberForm::Real, 32) => Some(u64::from((number as f32).to_bits())),
            (NumberForm::Real, _) => Some(number.to_bits()),
            // Below 2^53 every integer is a double, beyond it a cast would saturate at 2^63.
            _ if number.abs() >= 9e18 => None,
            _ => self.raw_of_integer(number.round() as i128),
        }
    }

    fn raw_of_integer(&self, number: i128) -> Option<u64> {
        let mask = mask_of(&(0..self.bits));
        let (low, high) = match self.form {
            NumberForm::Signed => (-(i128::from(mask >> 1) + 1), i128::from(mask >> 1)),
            _ => (0, i128::from(mask)),
        };
        (low..=high).contains(&number).then_some(number as u64 & mask)
    }
}

/// What a value of a PDO can be read as and written from: integers, `bool`, floating point, and the units of
/// [`crate::units`].
pub trait Sample: Copy {
    /// How a field is read as a number by default.
    const FORM: NumberForm;
    /// True if a field of this form holds such values.
    fn suits(field: &Field) -> bool;
    /// From the field's bits, the higher ones zero.
    fn from_field(raw: u64, field: &Field) -> Self;
    /// To the field's bits; `None` if they cannot hold the value.
    fn to_field(self, field: &Field) -> Option<u64>;
}

macro_rules! integers {
    ($($type:ty, $signed:literal;)*) => {$(
        impl Sample for $type {
            const FORM: NumberForm = if $signed { NumberForm::Signed } else { NumberForm::Unsigned };
            fn suits(field: &Field) -> bool {
                field.form == Self::FORM && field.bits <= <$type>::BITS
            }
            #[inline]
            fn from_field(raw: u64, field: &Field) -> Self {
                if $signed { field.sign_extended(raw) as Self } else { raw as Self }
            }
            fn to_field(self, field: &Field) -> Option<u64> {
                field.raw_of_integer(self.into())
            }
        }
    )*};
}

integers! {
    u8, false;
    u16, false;
    u32, false;
    u64, false;
    i8, true;
    i16, true;
    i32, true;
    i64, true;
}

impl Sample for bool {
    const FORM: NumberForm = NumberForm::Unsigned;

    fn suits(field: &Field) -> bool {
        field.form == NumberForm::Unsigned
    }

    fn from_field(raw: u64, _: &Field) -> Self {
        raw != 0
    }

    fn to_field(self, _: &Field) -> Option<u64> {
        Some(self.into())
    }
}

impl Sample for f64 {
    const FORM: NumberForm = NumberForm::Signed;

    fn suits(_: &Field) -> bool {
        true
    }

    #[inline]
    fn from_field(raw: u64, field: &Field) -> Self {
        field.number(raw) * field.per_count
    }

    fn to_field(self, field: &Field) -> Option<u64> {
        field.raw_of(self / field.per_count)
    }
}

macro_rules! quantities {
    ($($unit:ident)*) => {$(
        impl Sample for $unit {
            const FORM: NumberForm = NumberForm::Signed;
            fn suits(_: &Field) -> bool {
                true
            }
            #[inline]
            fn from_field(raw: u64, field: &Field) -> Self {
                Self(f64::from_field(raw, field))
            }
            fn to_field(self, field: &Field) -> Option<u64> {
                self.0.to_field(field)
            }
        }
    )*};
}

quantities! { Rpm Turns Amperes Volts Celsius }

/// An object that a node sends by TPDO, found once: reading it is an index and a shift. From
/// [`crate::Node::signal`] or, in physical units, from [`crate::Drive`].
#[derive(Debug)]
pub struct Signal<T> {
    pub(super) place: ImagePlace,
    pub(super) field: Field,
    kind: PhantomData<fn() -> T>,
}

/// An object that a node takes by RPDO, found once: writing it is an index, a mask and a shift. From
/// [`crate::Node::set_point`] or, in physical units, from [`crate::Drive`].
#[derive(Debug)]
pub struct SetPoint<T> {
    pub(super) place: ImagePlace,
    pub(super) field: Field,
    kind: PhantomData<fn(T)>,
}

macro_rules! handles {
    ($($handle:ident)*) => {$(
        impl<T> Clone for $handle<T> {
            fn clone(&self) -> Self {
                *self
            }
        }
        impl<T> Copy for $handle<T> {}
        impl<T: Sample> $handle<T> {
            /// `None` if a field of this form and length does not hold such values.
            pub(crate) fn new(place: ImagePlace, form: NumberForm, per_count: f64) -> Option<Self> {
                let field = Field { bits: place.bits(), form, per_count };
                // An entry without bits holds nothing, and REAL numbers have 32 or 64.
                let whole = field.bits > 0 && (form != NumberForm::Real || matches!(field.bits, 32 | 64));
                (whole && T::suits(&field)).then_some(Self { place, field, kind: PhantomData })
            }
            pub(crate) const fn place(&self) -> ImagePlace {
                self.place
            }
            /// How the object's bits are a number.
            pub const fn field(&self) -> &Field {
                &self.field
            }
        }
    )*};
}

handles! { Signal SetPoint }

#[cfg(test)]
mod tests {
    use super::*;

    fn field(bits: u32, form: NumberForm, per_count: f64) -> Field {
        Field { bits, form, per_count }
    }

    #[test]
    fn signs_are_extended_from_the_mapped_length() {
        let speed = field(16, NumberForm::Signed, 0.1);
        assert_eq!(i32::from_field(0xFFFE, &speed), -2);
        assert_eq!(Rpm::from_field(0xFE0C, &speed), Rpm(-50.0));
        assert_eq!(Rpm(-50.0).to_field(&speed), Some(0xFE0C));
        assert_eq!(i64::from_field(u64::MAX, &field(64, NumberForm::Signed, 1.0)), -1);
        assert_eq!(i8::from_field(0b101, &field(3, NumberForm::Signed, 1.0)), -3);
    }

    #[test]
    fn what_a_field_cannot_hold_is_not_cut_off() {
        let small = field(8, NumberForm::Signed, 1.0);
        assert_eq!(
            [127, 128, -128, -129].map(|value: i32| value.to_field(&small)),
            [Some(0x7F), None, Some(0x80), None]
        );
        assert_eq!(f64::NAN.to_field(&small), None);
        assert_eq!(1e300.to_field(&field(64, NumberForm::Signed, 1.0)), None);
        assert_eq!((-1.0).to_field(&field(16, NumberForm::Unsigned, 1.0)), None);
        assert_eq!(u64::MAX.to_field(&field(64, NumberForm::Unsigned, 1.0)), Some(u64::MAX));
    }

    #[test]
    fn reals_are_their_bits() {
        // IEEE 754: 1.5 is 3FC00000h and 3FF8000000000000h.
        assert_eq!(f64::from_field(0x3FC0_0000, &field(32, NumberForm::Real, 1.0)), 1.5);
        assert_eq!(1.5.to_field(&field(64, NumberForm::Real, 1.0)), Some(0x3FF8_0000_0000_0000));
    }

    #[test]
    fn a_type_that_is_too_short_or_of_another_sign_is_distinguished() {
        assert!(i32::suits(&field(16, NumberForm::Signed, 1.0)) && !i8::suits(&field(16, NumberForm::Signed, 1.0)));
        assert!(!u32::suits(&field(16, NumberForm::Signed, 1.0)) && !i32::suits(&field(32, NumberForm::Real, 1.0)));
    }

    #[test]
    fn a_field_without_bits_is_no_signal() {
        let place = ImagePlace { slot: 0, generation: 0, shift: 0, mask: 0 };
        assert!(Signal::<i32>::new(place, NumberForm::Signed, 1.0).is_none());
        assert!(Signal::<bool>::new(place, NumberForm::Unsigned, 1.0).is_none());
        let short = ImagePlace { mask: 0xFFFF, ..place };
        assert!(SetPoint::<f64>::new(short, NumberForm::Real, 1.0).is_none());
    }

    #[test]
    fn a_place_is_put_without_touching_its_neighbours() {
        let place = ImagePlace { slot: 0, generation: 0, shift: 16, mask: 0xFFFF };
        assert_eq!(place.put(u64::MAX, 0x1_0000), 0xFFFF_FFFF_0000_FFFF);
        assert_eq!(place.of(0x1234_5678), 0x1234);
        let whole = ImagePlace { slot: 0, generation: 0, shift: 0, mask: mask_of(&(0..64)) };
        assert_eq!((whole.put(1, u64::MAX), whole.bits()), (u64::MAX, 64));
    }
}
