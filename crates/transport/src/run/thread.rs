//! A bus in a thread of its own, which runs in real time.

use std::fmt;
use std::future::Future;
use std::pin::{Pin, pin};
use std::sync::Arc;
use std::thread;

use can::{Instant, Station};
use tokio::sync::{Notify, mpsc, oneshot};

use super::run_station;
use crate::realtime::{self, RealTimeError};
use crate::{AnyBus, BusError, BusSpec, Note, WallClock};

/// Notes that may wait for their listener; further ones are dropped, as a bus does not wait.
const NOTES_WAITING: usize = 256;

/// Why a bus does not run in real time.
#[derive(Debug, thiserror::Error)]
pub enum BusThreadError {
    /// The thread may not.
    #[error(transparent)]
    RealTime(RealTimeError),
    /// The bus does not open.
    #[error(transparent)]
    Bus(BusError),
    /// The system has no thread, or no runtime for it.
    #[error("cannot start the thread of the bus")]
    Thread(#[source] std::io::Error),
}

/// What the thread does with its bus.
type BusJob = Box<dyn FnOnce(AnyBus, WallClock) -> Pin<Box<dyn Future<Output = ()>>> + Send>;

/// A bus in a thread of its own, which runs in real time ([`realtime::enter`]) with the thread of its clock and no other: what the
/// caller computes, prints and waits for holds up no frame.
pub struct BusThread {
    work: oneshot::Sender<BusJob>,
}

impl fmt::Debug for BusThread {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("BusThread").finish_non_exhaustive()
    }
}

impl BusThread {
    /// Starts the thread and opens the bus there. The clock is that of the bus.
    pub async fn open(spec: BusSpec) -> Result<(Self, WallClock), BusThreadError> {
        let (reported, opened) = oneshot::channel();
        let (work, given) = oneshot::channel();
        let thread = thread::Builder::new().name("ferrodrive bus".into());
        thread.spawn(move || serve(&spec, reported, given)).map_err(BusThreadError::Thread)?;
        match opened.await {
            Ok(clock) => Ok((Self { work }, clock?)),
            Err(_) => Err(BusThreadError::Thread(std::io::Error::other("it has ended"))),
        }
    }

    /// As [`run_station`], with `station` in the thread of the bus, and `until` and `tell` in this one. Whatever makes the station
    /// offer something from here calls `wakeup.notify_one()` behind it.
    pub async fn run<S, U>(
        self,
        mut station: S,
        wakeup: Arc<Notify>,
        until: U,
        mut tell: impl FnMut(Instant, &Note),
    ) -> Result<U::Output, BusError>
    where
        S: Station + Send + 'static,
        U: Future,
    {
        let (over, is_over) = oneshot::channel::<()>();
        let (reported, mut notes) = mpsc::channel(NOTES_WAITING);
        let (ended, mut end) = oneshot::channel();
        let work: BusJob = Box::new(move |mut bus, clock| {
            Box::pin(async move {
                let tell = |at, note: &Note| drop(reported.try_send((at, note.clone())));
                let run = run_station(&mut bus, &mut station, &clock, &wakeup, is_over, tell);
                let _ = ended.send(run.await.map(drop));
            })
        });
        // A thread that has ended is reported below.
        let _ = self.work.send(work);
        let mut until = pin!(until);
        let output = loop {
            tokio::select! {
                biased;
                output = &mut until => break output,
                Some((at, note)) = notes.recv() => tell(at, &note),
                ended = &mut end => return Err(match ended {
                    Ok(Err(error)) => error,
                    Ok(Ok(())) | Err(_) => BusError::ThreadEnded,
                }),
            }
        };
        // The thread sends what is left to be sent, and ends.
        let _ = over.send(());
        match end.await {
            Ok(ended) => ended.map(|()| output),
            Err(_) => Err(BusError::ThreadEnded),
        }
    }
}

fn serve(
    spec: &BusSpec,
    reported: oneshot::Sender<Result<WallClock, BusThreadError>>,
    given: oneshot::Receiver<BusJob>,
) {
    let entered = realtime::enter().and_then(|()| WallClock::start_in_real_time());
    let clock = match entered {
        Ok(clock) => clock,
        Err(error) => return drop(reported.send(Err(BusThreadError::RealTime(error)))),
    };
    let runtime = match tokio::runtime::Builder::new_current_thread().enable_all().build() {
        Ok(runtime) => runtime,
        Err(error) => return drop(reported.send(Err(BusThreadError::Thread(error)))),
    };
    runtime.block_on(async {
        let bus = match spec.open(&clock).await {
            Ok(bus) => bus,
            Err(error) => return drop(reported.send(Err(BusThreadError::Bus(error)))),
        };
        if reported.send(Ok(clock.clone())).is_err() {
            return;
        }
        if let Ok(work) = given.await {
            work(bus, clock).await;
        }
    });
}
