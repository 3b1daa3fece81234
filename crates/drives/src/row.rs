//! What writes to the rows of a table set in motion.

use canopen::od::Slot;

/// What a write to each row of a table does: `OBJECT => Effect;` where it is named, or else the one in
/// the head. The function `effect` looks it up.
macro_rules! effects {
    ($rows:ident else $other:ident: $($object:ident => $effect:ident;)*) => {
        /// What a write to `slot` does.
        #[inline]
        pub fn effect(slot: canopen::od::Slot) -> Effect {
            EFFECTS[slot.position()]
        }

        static EFFECTS: [Effect; $rows] =
            crate::row::by_position(&[$(($object.slot(), Effect::$effect)),*], Effect::$other);
    };
}
pub(crate) use effects;

/// `named` by the position of their rows, and `other` at all other positions.
pub(crate) const fn by_position<E: Copy, const N: usize>(named: &[(Slot, E)], other: E) -> [E; N] {
    let mut all = [other; N];
    let mut i = 0;
    while i < named.len() {
        all[named[i].0.position()] = named[i].1;
        i += 1;
    }
    all
}
