//! How the chunks of an MCAP file are compressed: with Zstandard (RFC 8878). Its library is in C, which WebAssembly is built without:
//! there chunks are written as they are, and compressed ones are not read.

use std::io::{self, Read};

/// How the specification names Zstandard.
pub(super) const ZSTD: &str = "zstd";
/// How the specification names the frame format of LZ4, in which other programs, and earlier records, have their chunks.
const LZ4: &str = "lz4";

#[cfg(not(target_family = "wasm"))]
mod packer {
    use std::io::{self, Read};

    use zstd::bulk::Compressor;

    /// What chunks are written in.
    pub(crate) const WRITTEN: &str = super::ZSTD;
    /// The level that makes the smallest records of all below 10: rows of numbers repeat at one distance, which it finds at once.
    const LEVEL: i32 = 1;

    /// Compresses chunks.
    pub(crate) struct Packer(Compressor<'static>);

    impl Packer {
        pub(crate) fn new() -> io::Result<Self> {
            Compressor::new(LEVEL).map(Self)
        }

        pub(crate) fn pack(&mut self, chunk: &[u8]) -> io::Result<Vec<u8>> {
            self.0.compress(chunk)
        }
    }

    pub(super) fn unpack(data: &[u8], size: u64, plain: &mut Vec<u8>) -> Result<io::Result<usize>, String> {
        Ok(zstd::Decoder::new(data).and_then(|data| data.take(size).read_to_end(plain)))
    }
}

#[cfg(target_family = "wasm")]
mod packer {
    use std::io;

    /// What chunks are written in: as they are.
    pub(crate) const WRITTEN: &str = "";

    /// Leaves chunks as they are.
    pub(crate) struct Packer(());

    impl Packer {
        pub(crate) fn new() -> io::Result<Self> {
            Ok(Self(()))
        }

        pub(crate) fn pack(&mut self, chunk: &[u8]) -> io::Result<Vec<u8>> {
            Ok(chunk.to_vec())
        }
    }

    pub(super) fn unpack(_: &[u8], _: u64, _: &mut Vec<u8>) -> Result<io::Result<usize>, String> {
        Err("its chunks are compressed with 'zstd', which is not read in a page; use the ferrodrive program".into())
    }
}

pub(super) use packer::{Packer, WRITTEN};

/// What a chunk holds, `size` bytes at most.
///
/// # Errors
/// A sentence: it is compressed in a way that is not read. The inner error: it is torn.
pub(super) fn unpacked(compression: &str, data: &[u8], size: u64) -> Result<io::Result<Vec<u8>>, String> {
    let mut plain = Vec::new();
    let read = match compression {
        "" => data.take(size).read_to_end(&mut plain),
        ZSTD => packer::unpack(data, size, &mut plain)?,
        LZ4 => lz4_flex::frame::FrameDecoder::new(data).take(size).read_to_end(&mut plain),
        other => {
            return Err(format!("its chunks are compressed with '{other}'; expected '{ZSTD}', '{LZ4}', or none"));
        }
    };
    Ok(read.map(|_| plain))
}
