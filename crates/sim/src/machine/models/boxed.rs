//! Room for devices that are known at run time only.

use canopen::od::Storage;

/// Boxes, as large as a device's table asks for.
#[derive(Clone, Copy, Debug)]
pub struct Boxed;

impl Storage for Boxed {
    type Cells = Box<[u32]>;
    type Bytes = Box<[u8]>;
    type Pdos<P: Copy> = Box<[P]>;
    type Words = Box<[u64]>;
    type Events<E: Copy> = Box<[E]>;
    type Channels<C: Clone> = Box<[C]>;

    fn cells(count: usize) -> Self::Cells {
        vec![0; count].into()
    }

    fn bytes(count: usize) -> Self::Bytes {
        vec![0; count].into()
    }

    fn pdos<P: Copy>(count: usize, empty: P) -> Self::Pdos<P> {
        vec![empty; count].into()
    }

    fn words(count: usize) -> Self::Words {
        vec![0; count.div_ceil(64)].into()
    }

    fn events<E: Copy>(count: usize, empty: E) -> Self::Events<E> {
        vec![empty; count].into()
    }

    fn channels<C: Clone>(count: usize, empty: C) -> Self::Channels<C> {
        vec![empty; count].into()
    }
}
