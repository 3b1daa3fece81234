//! The trace: lines of it as JSON, and all of it as a log. Decoding is done in another thread than the task that moves drives.

use std::io::Cursor;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::Duration;

use axum::body::Body;
use axum::extract::Query as InAddress;
use axum::extract::rejection::QueryRejection;
use axum::http::StatusCode;
use axum::http::header::{CONTENT_DISPOSITION, CONTENT_TYPE};
use axum::response::{IntoResponse, Response};
use futures_util::stream;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use super::answer::{json_text, trouble};
use super::loaded::replaced;
use canlog::{Direction, Format, Interface, LogWriter, Record};
use host::HostHandle;
use host::trace::{Asked, AskedSeries, Held, Origin, Query};

/// Readers whose lines are decoded at the same time; others wait their turn. However many read, a second core is free for
/// the task that moves drives.
const DECODING: usize = 1;

/// Logs downloaded at the same time. Each may hold the frames of its start for as long as it is read.
const SAVING: usize = 4;

/// A client that reads nothing of its log for this long (at most twice as long) loses its place.
const SAVING_PATIENCE: Duration = Duration::from_secs(10);

/// Requests admitted at a time.
#[derive(Clone)]
pub(super) struct Doors {
    decoding: Arc<Semaphore>,
    saving: Arc<Semaphore>,
}

impl Default for Doors {
    fn default() -> Self {
        Self { decoding: Arc::new(Semaphore::new(DECODING)), saving: Arc::new(Semaphore::new(SAVING)) }
    }
}

/// The parameters of a request.
pub(super) type InQuery = Result<InAddress<Asked>, QueryRejection>;

/// The newest lines that match the query.
pub(super) async fn lines(handle: HostHandle, doors: Doors, asked: InQuery) -> Response {
    decoded(handle, doors, asked, |query, held| serde_json::to_string(&query.select(held))).await
}

/// The newest frames that match the query, by identifier.
pub(super) async fn identifiers(handle: HostHandle, doors: Doors, asked: InQuery) -> Response {
    decoded(handle, doors, asked, |query, held| serde_json::to_string(&query.identifiers(held))).await
}

/// Lines of a log that was loaded, `None` where it is not kept any more.
pub(super) async fn loaded_lines(log: Option<Held>, doors: Doors, asked: InQuery) -> Response {
    match log {
        Some(log) => decoded(log, doors, asked, |query, held| serde_json::to_string(&query.select(held))).await,
        None => replaced(),
    }
}

/// The same by identifier.
pub(super) async fn loaded_identifiers(log: Option<Held>, doors: Doors, asked: InQuery) -> Response {
    match log {
        Some(log) => decoded(log, doors, asked, |query, held| serde_json::to_string(&query.identifiers(held))).await,
        None => replaced(),
    }
}

/// The frames that a reader asks about.
trait Frames: Send + 'static {
    fn frames(self) -> Held;
}

/// Those of the bus at the time when it is the reader's turn.
impl Frames for HostHandle {
    fn frames(self) -> Held {
        self.trace().held()
    }
}

impl Frames for Held {
    fn frames(self) -> Held {
        self
    }
}

async fn decoded(
    of: impl Frames,
    doors: Doors,
    asked: InQuery,
    work: impl FnOnce(&Query, &Held) -> serde_json::Result<String> + Send + 'static,
) -> Response {
    match understand(asked) {
        Ok(query) => held(of, doors, move |held| work(&query, held)).await,
        Err(refusal) => *refusal,
    }
}

/// The values of objects over time.
pub(super) async fn series(
    handle: HostHandle,
    doors: Doors,
    asked: Result<InAddress<AskedSeries>, QueryRejection>,
) -> Response {
    let asked = asked.map_err(|rejection| rejection.body_text()).and_then(|InAddress(asked)| asked.understand());
    match asked {
        Ok(query) => held(handle, doors, move |held| serde_json::to_string(&query.values(held))).await,
        Err(why) => trouble(StatusCode::BAD_REQUEST, "malformed", &why),
    }
}

/// What is made of the frames that are held, when it is this reader's turn. The turn ends with the work, which goes on if the reader
/// goes away.
async fn held(
    of: impl Frames,
    doors: Doors,
    work: impl FnOnce(&Held) -> serde_json::Result<String> + Send + 'static,
) -> Response {
    let Ok(turn) = doors.decoding.acquire_owned().await else { return over() };
    let held = of.frames();
    let work = move || {
        let _turn = turn;
        work(&held)
    };
    match tokio::task::spawn_blocking(work).await {
        Ok(Ok(json)) => json_text(json),
        _ => over(),
    }
}

/// All frames of the chosen nodes and kinds, as a candump log.
pub(super) fn log(handle: HostHandle, doors: &Doors, asked: InQuery) -> Response {
    let query = match understand(asked) {
        Ok(query) => query,
        Err(refusal) => return *refusal,
    };
    let Ok(door) = Arc::clone(&doors.saving).try_acquire_owned() else {
        return trouble(StatusCode::TOO_MANY_REQUESTS, "busy", "others are saving the trace: try again later");
    };
    handle.trace().note_saved();
    let held = Arc::new(handle.trace().held());
    let place = Arc::new(DownloadPlace { kept: Mutex::new(Some((held, door))), asked: AtomicU64::new(0) });
    tokio::spawn(give_up_idle(Arc::downgrade(&place)));
    let saving = Saving { handle, place, query: Arc::new(query), next: 0 };
    let parts = stream::unfold(saving, async |saving| {
        let Saving { handle, place, query, next } = &saving;
        let (handle, held, query, next) = (handle.clone(), place.held()?, Arc::clone(query), *next);
        let work = tokio::task::spawn_blocking(move || query.log_part(&held, handle.trace().origin(), next));
        let part = work.await.ok()??;
        Some((Ok::<_, std::convert::Infallible>(part.text), Saving { next: part.next, ..saving }))
    });
    // The file name is that of the address, or the one that the page gives.
    let headers = [(CONTENT_TYPE, "text/plain; charset=utf-8"), (CONTENT_DISPOSITION, "attachment")];
    (headers, Body::from_stream(parts)).into_response()
}

/// The same in a form that is made as a whole, some 5 MB of it.
pub(super) async fn saved(handle: HostHandle, doors: &Doors, asked: InQuery, format: Format) -> Response {
    let query = match understand(asked) {
        Ok(query) => query,
        Err(refusal) => return *refusal,
    };
    let Ok(door) = Arc::clone(&doors.saving).try_acquire_owned() else {
        return trouble(StatusCode::TOO_MANY_REQUESTS, "busy", "others are saving the trace: try again later");
    };
    handle.trace().note_saved();
    let held = handle.trace().held();
    let work = tokio::task::spawn_blocking(move || {
        let _door = door;
        log_in(format, &query, &held, handle.trace().origin())
    });
    let headers = [(CONTENT_TYPE, "application/octet-stream"), (CONTENT_DISPOSITION, "attachment")];
    match work.await {
        Ok(Ok(file)) => (headers, file).into_response(),
        _ => over(),
    }
}

fn log_in(format: Format, query: &Query, held: &Held, origin: &Origin) -> std::io::Result<Vec<u8>> {
    let mut log = LogWriter::new(Cursor::new(Vec::new()), format).map_err(std::io::Error::other)?;
    let interface = Interface::named(&origin.interface);
    let mut written = Ok(());
    query.all_frames(held, |passed| {
        let direction = if passed.own { Direction::Transmitted } else { Direction::Received };
        let record = Record {
            interface,
            direction: Some(direction),
            ..Record::of_frame(passed.at + origin.unix_zero, passed.frame)
        };
        if written.is_ok() {
            written = log.write(&record);
        }
    });
    written?;
    Ok(log.finish()?.into_inner())
}

/// A log being downloaded.
struct Saving {
    handle: HostHandle,
    place: Arc<DownloadPlace>,
    query: Arc<Query>,
    next: u64,
}

/// One of the places for downloads, with the frames that it holds as long as its client keeps reading.
struct DownloadPlace {
    kept: Mutex<Option<(Arc<Held>, OwnedSemaphorePermit)>>,
    /// Counts the reads.
    asked: AtomicU64,
}

impl DownloadPlace {
    /// The frames; `None` once they were released, which ends the log.
    fn held(&self) -> Option<Arc<Held>> {
        self.asked.fetch_add(1, Ordering::Relaxed);
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.as_ref().map(|(held, _)| Arc::clone(held))
    }
}

/// Releases a place when its client reads nothing.
async fn give_up_idle(place: Weak<DownloadPlace>) {
    let mut before = None;
    loop {
        tokio::time::sleep(SAVING_PATIENCE).await;
        let Some(place) = place.upgrade() else { return };
        let asked = Some(place.asked.load(Ordering::Relaxed));
        if asked == before {
            place.kept.lock().unwrap_or_else(PoisonError::into_inner).take();
            return;
        }
        before = asked;
    }
}

fn understand(asked: InQuery) -> Result<Query, Box<Response>> {
    let asked = asked.map_err(|rejection| rejection.body_text()).and_then(|InAddress(asked)| asked.understand());
    asked.map_err(|why| Box::new(trouble(StatusCode::BAD_REQUEST, "malformed", &why)))
}

fn over() -> Response {
    trouble(StatusCode::SERVICE_UNAVAILABLE, "over", "the studio is ending")
}
