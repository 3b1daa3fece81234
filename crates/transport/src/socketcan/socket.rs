//! A raw CAN socket of Linux, bound to one interface: messages with the kernel's time stamps.

use std::io::{self, IoSliceMut};
use std::os::fd::AsRawFd;
use std::time::Duration;

use can::{CanId, Frame};
use nix::sys::socket::{ControlMessageOwned, MsgFlags, recvmsg, setsockopt, sockopt};
use nix::sys::time::TimeSpec;
use socketcan::{CanFdSocket, Socket as _, SocketOptions as _};
use tokio::io::Interest;
use tokio::io::unix::AsyncFd;

use super::wire::{self, FD_LENGTH, KernelMessage};

/// What a reader waits for: messages, and that the interface goes down, which the kernel reports as an error without a message.
const HEARS: Interest = Interest::READABLE.add(Interest::ERROR);

/// A socket that hears everything on its interface but what it sent itself.
#[derive(Debug)]
pub(super) struct Socket {
    inner: AsyncFd<CanFdSocket>,
    /// Room for what the kernel says of a message: its time stamp and how many were lost before it.
    control: Vec<u8>,
}

/// A message that came.
#[derive(Clone, Copy, Debug)]
pub(super) struct Incoming {
    pub(super) message: KernelMessage,
    /// Unix time at which the kernel had it from the driver; `None` where it does not report that.
    pub(super) stamp: Option<Duration>,
    /// How many messages the socket has lost since it was opened, for want of room.
    pub(super) lost: u32,
}

impl Socket {
    /// Opens one on `interface`, which exists. Error messages of every class and FD frames are heard too.
    pub(super) fn open(interface: &str) -> io::Result<Self> {
        let socket = CanFdSocket::open(interface)?;
        socket.set_nonblocking(true)?;
        socket.set_error_filter_accept_all()?;
        setsockopt(&socket, sockopt::ReceiveTimestampns, &true)?;
        setsockopt(&socket, sockopt::RxqOvfl, &1)?;
        // Its successor, `register`, is for unsafe code: it lets the caller swear that the descriptor stays open as long as
        // its owner. A socket that owns its descriptor and lends it only by reference, as this one, keeps to that.
        #[allow(deprecated, reason = "the sound form needs an unsafe block, which the project forbids")]
        let inner = AsyncFd::with_interest(socket, HEARS | Interest::WRITABLE)?;
        Ok(Self { inner, control: nix::cmsg_space!(TimeSpec, u32) })
    }

    /// Lets only frames with these identifiers through; of none all. Error messages come in any case: they have a filter of
    /// their own.
    pub(super) fn set_filter(&self, ids: &[CanId]) -> io::Result<()> {
        let socket = self.inner.get_ref();
        if ids.is_empty() {
            return socket.set_filter_accept_all();
        }
        let filters: Vec<(u32, u32)> = ids.iter().map(|id| wire::filter(*id)).collect();
        socket.set_filters(&filters)
    }

    /// Whether this program may open sockets of CAN at all.
    pub(super) fn probe() -> io::Result<()> {
        // Number 0: of no interface in particular.
        CanFdSocket::open_iface(0).map(drop)
    }

    /// The next message. Cancel-safe.
    pub(super) async fn receive(&mut self) -> io::Result<Incoming> {
        loop {
            let mut ready = self.inner.ready(HEARS).await?;
            let control = &mut self.control;
            match ready.try_io(|socket| receive_now(socket.get_ref(), control)) {
                // A message of neither form: of a protocol that was not asked for.
                Ok(Ok(None)) | Err(_) => {}
                Ok(Ok(Some(incoming))) => return Ok(incoming),
                Ok(Err(error)) => return Err(error),
            }
        }
    }

    /// Hands a frame to the interface's send queue. Cancel-safe.
    pub(super) async fn send(&self, frame: &Frame) -> io::Result<()> {
        let bytes = wire::emit(frame);
        loop {
            let mut ready = self.inner.writable().await?;
            if let Ok(sent) = ready.try_io(|socket| socket.get_ref().as_raw_socket().send(&bytes)) {
                return sent.map(|_| ());
            }
        }
    }
}

fn receive_now(socket: &CanFdSocket, control: &mut [u8]) -> io::Result<Option<Incoming>> {
    let mut bytes = [0; FD_LENGTH];
    let mut parts = [IoSliceMut::new(&mut bytes)];
    let received = recvmsg::<()>(socket.as_raw_fd(), &mut parts, Some(control), MsgFlags::empty())?;
    let (length, mut stamp, mut lost) = (received.bytes, None, 0);
    for said in received.cmsgs()? {
        match said {
            ControlMessageOwned::ScmTimestampns(time) => stamp = Some(Duration::from(time)),
            ControlMessageOwned::RxqOvfl(count) => lost = count,
            _ => {}
        }
    }
    Ok(wire::parse(&bytes[..length]).map(|message| Incoming { message, stamp, lost }))
}
