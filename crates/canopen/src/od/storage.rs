use core::fmt;

/// Where the values of a dictionary and the PDOs of a node are kept.
///
/// A firmware has [`Fixed`]: arrays of a size that is known when it is compiled. A program that learns of its objects at
/// run time implements this trait with boxes, each of its types a slice:
///
/// ```
/// use canopen::od::Storage;
///
/// #[derive(Clone)]
/// struct Boxed;
///
/// impl Storage for Boxed {
///     type Cells = Box<[u32]>;
///     type Bytes = Box<[u8]>;
///     type Pdos<P: Copy> = Box<[P]>;
///     type Words = Box<[u64]>;
///     type Events<E: Copy> = Box<[E]>;
///     type Channels<C: Clone> = Box<[C]>;
///
///     fn cells(count: usize) -> Self::Cells { vec![0; count].into() }
///     fn bytes(count: usize) -> Self::Bytes { vec![0; count].into() }
///     fn pdos<P: Copy>(count: usize, empty: P) -> Self::Pdos<P> { vec![empty; count].into() }
///     fn words(count: usize) -> Self::Words { vec![0; count.div_ceil(64)].into() }
///     fn events<E: Copy>(count: usize, empty: E) -> Self::Events<E> { vec![empty; count].into() }
///     fn channels<C: Clone>(count: usize, empty: C) -> Self::Channels<C> { vec![empty; count].into() }
/// }
/// ```
///
/// Each function gives at least as many elements as are asked for, or panics; all of them at their empty value.
pub trait Storage: Clone {
    /// 32-bit cells, one a row.
    type Cells: AsRef<[u32]> + AsMut<[u32]> + Clone;
    /// Bytes of values that are longer than a cell.
    type Bytes: AsRef<[u8]> + AsMut<[u8]> + Clone;
    /// Something of each PDO of one direction.
    type Pdos<P: Copy>: AsRef<[P]> + AsMut<[P]> + Clone;
    /// A bit for each PDO of one direction, 64 a word.
    type Words: AsRef<[u64]> + AsMut<[u64]> + Clone;
    /// What waits for the owner. As many as a power of two.
    type Events<E: Copy>: AsRef<[E]> + AsMut<[E]> + Clone;
    /// Something of each SDO server beside the default one.
    type Channels<C: Clone>: AsRef<[C]> + AsMut<[C]> + Clone;

    /// Cells for `count` rows, all 0.
    fn cells(count: usize) -> Self::Cells;
    /// `count` bytes, all 0.
    fn bytes(count: usize) -> Self::Bytes;
    /// `empty` for `count` PDOs.
    fn pdos<P: Copy>(count: usize, empty: P) -> Self::Pdos<P>;
    /// No bit set for `count` PDOs.
    fn words(count: usize) -> Self::Words;
    /// Places for `count` events, a power of two.
    fn events<E: Copy>(count: usize, empty: E) -> Self::Events<E>;
    /// `empty` for `count` SDO servers.
    fn channels<C: Clone>(count: usize, empty: C) -> Self::Channels<C>;
}

/// Arrays: `ROWS` cells, `BYTES` bytes of longer values ([`Table::byte_count`](super::Table::byte_count)), `PDOS` PDOs
/// each way, places for `EVENTS` events, a power of two, 64 PDOs for each of `WORDS`, and `CHANNELS` SDO servers beside the
/// default one.
#[derive(Clone, Copy)]
pub struct Fixed<
    const ROWS: usize,
    const BYTES: usize = 0,
    const PDOS: usize = 4,
    const EVENTS: usize = 64,
    const WORDS: usize = 1,
    const CHANNELS: usize = 0,
>;

impl<
    const ROWS: usize,
    const BYTES: usize,
    const PDOS: usize,
    const EVENTS: usize,
    const WORDS: usize,
    const CHANNELS: usize,
> Storage for Fixed<ROWS, BYTES, PDOS, EVENTS, WORDS, CHANNELS>
{
    type Cells = [u32; ROWS];
    type Bytes = [u8; BYTES];
    type Pdos<P: Copy> = [P; PDOS];
    type Words = [u64; WORDS];
    type Events<E: Copy> = [E; EVENTS];
    type Channels<C: Clone> = [C; CHANNELS];

    fn cells(count: usize) -> Self::Cells {
        assert!(count <= ROWS, "the table has more rows than the dictionary has cells");
        [0; ROWS]
    }

    fn bytes(count: usize) -> Self::Bytes {
        assert!(count <= BYTES, "the long values of the table have more bytes than the dictionary");
        [0; BYTES]
    }

    fn pdos<P: Copy>(count: usize, empty: P) -> Self::Pdos<P> {
        assert!(count <= PDOS, "the table has more PDOs than the node");
        [empty; PDOS]
    }

    fn words(count: usize) -> Self::Words {
        const { assert!(PDOS <= WORDS * 64, "a word for every 64 PDOs") };
        assert!(count <= PDOS, "the table has more PDOs than the node");
        [0; WORDS]
    }

    fn events<E: Copy>(count: usize, empty: E) -> Self::Events<E> {
        const { assert!(EVENTS.is_power_of_two(), "as many events as a power of two") };
        assert!(count <= EVENTS, "one frame can make more events than the node has places for");
        [empty; EVENTS]
    }

    fn channels<C: Clone>(count: usize, empty: C) -> Self::Channels<C> {
        assert!(count <= CHANNELS, "the table has more SDO servers than the node");
        core::array::from_fn(|_| empty.clone())
    }
}

impl<
    const ROWS: usize,
    const BYTES: usize,
    const PDOS: usize,
    const EVENTS: usize,
    const WORDS: usize,
    const CHANNELS: usize,
> fmt::Debug for Fixed<ROWS, BYTES, PDOS, EVENTS, WORDS, CHANNELS>
{
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Fixed<{ROWS} rows, {BYTES} bytes, {PDOS} PDOs, {EVENTS} events>")
    }
}
