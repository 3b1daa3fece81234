use canopen::Mux;

/// Which axis of a device: 0 is the first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct AxisId(pub u8);

impl AxisId {
    /// The first, and of most drives the only one.
    pub const FIRST: Self = Self(0);
}

/// Where an axis has the objects that a drive of one axis has from 6000h on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Placement {
    /// This many indexes further on: 0 for the first axis, 800h for the second (CiA 402-1: eight blocks of 800h from 6000h to
    /// 9FFFh). Objects below 6000h and from A000h on are the device's.
    IndexOffset(u16),
    /// At this sub-index of the same index, as drives have it whose two axes are not two devices. Objects with sub-indexes of
    /// their own, objects below 6000h and those of `shared` are the device's.
    SubIndex {
        /// The sub-index.
        sub_index: u8,
        /// Indexes that all axes have in common.
        shared: &'static [u16],
    },
}

impl Placement {
    /// The first axis of a device that follows CiA 402.
    pub const FIRST: Self = Self::IndexOffset(0);

    /// Where this axis has an object that a drive of one axis has there.
    pub const fn place(self, mux: Mux) -> Mux {
        match (self, mux.index) {
            (Self::IndexOffset(offset), 0x6000..=0x67FF) => Mux::new(mux.index + offset, mux.sub_index),
            (Self::SubIndex { sub_index, shared }, 0x6000..=0x67FF)
                if mux.sub_index == 0 && !contains(shared, mux.index) =>
            {
                Mux::new(mux.index, sub_index)
            }
            _ => mux,
        }
    }
}

const fn contains(indexes: &[u16], index: u16) -> bool {
    let mut at = 0;
    while at < indexes.len() {
        if indexes[at] == index {
            return true;
        }
        at += 1;
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_axis_of_the_standard_is_800h_further_on() {
        let second = Placement::IndexOffset(0x800);
        assert_eq!(second.place(Mux::new(0x6040, 0)), Mux::new(0x6840, 0));
        assert_eq!(second.place(Mux::new(0x6099, 2)), Mux::new(0x6899, 2));
        // What the maker and CiA 301 define is the device's.
        assert_eq!(second.place(Mux::new(0x2005, 0)), Mux::new(0x2005, 0));
        assert_eq!(second.place(Mux::new(0x1001, 0)), Mux::new(0x1001, 0));
        assert_eq!(Placement::FIRST.place(Mux::new(0x60FF, 0)), Mux::new(0x60FF, 0));
    }

    #[test]
    fn an_axis_at_a_sub_index_shares_what_is_said_to_be_shared() {
        let right = Placement::SubIndex { sub_index: 2, shared: &[0x6040, 0x6041, 0x6060, 0x6061] };
        assert_eq!(right.place(Mux::new(0x60FF, 0)), Mux::new(0x60FF, 2));
        assert_eq!(right.place(Mux::new(0x6040, 0)), Mux::new(0x6040, 0));
    }
}
