//! The proposed gains on the drive itself: written, tried, and kept or taken back.

use std::path::{Path, PathBuf};
use std::time::Duration;

use canopen::NodeId;
use cia402::RAD_S_PER_RPM;
use master::Drive;
use master::parameters::Parameters;
use tune::Objective;
use words::failure::{Failure, both};

use super::bench::{CURRENT_KIND, ENOUGH_CURRENT, SWINGS, bytes};
use super::moves::{MoveRow, TrialMove, WRITTEN};
use super::setup::keep;
use super::{
    Bench, Excursion, Proposed, Reader, Request, SAMPLE_PERIODS, Setup, StepResponse, TuneReport, find, loops_of,
};
use crate::capture::{Restorer, with_left};
use crate::network::Progress;
use crate::network::params::Transaction;
use crate::network::params::journal::Kept;

/// How long the answer of the drive to a step is looked at.
const ANSWER_S: f64 = 0.5;
/// By how much a drive may be worse than its twin.
const MORE_THAN_TWIN: f64 = 1.3;
const BACK: &str = "it was given its former gains back";

/// What a drive does in a trial.
struct Answers {
    step: StepResponse,
    /// What its current does where it turns slowly, A.
    slow_ripple_a: f64,
    /// How it moves, with what was seen of a shaft that came to stand without power alone.
    moved: Option<(MoveRow, Option<Failure>)>,
}

/// Measures a drive, finds gains, and has it [`try_gains`], if that was asked for. What leads back from where it is given up on the
/// way is in `restorer`.
///
/// # Errors
/// What stopped it, what is not possible with this drive, that a journal of former gains is there already, and that not everything could
/// be put back.
pub async fn tune(
    (drive, restorer): (&Drive, &Restorer),
    request: &Request,
    progress: &impl Progress,
    wants_back: impl Future<Output = bool>,
) -> Result<TuneReport, Failure> {
    let id = drive.node().id();
    if request.apply {
        // Before anything moves.
        check_no_former(request, id)?;
    }
    let mut excursion = Excursion::default();
    progress.show(format!("node {id}: measuring, about half a minute"));
    let found = find((drive, restorer), request, &mut excursion).await?;
    if !request.apply {
        return Ok(found.0);
    }
    try_gains((drive, restorer), request, found, &mut excursion, progress, wants_back).await
}

/// The journal of an earlier tuning is not there.
fn check_no_former(request: &Request, id: NodeId) -> Result<(), Failure> {
    request.journal.as_deref().map(former_gains).map_or(Ok(()), |path| Kept::check_free(&path, id))
}

/// Has a drive try gains that were [found](find): a step and a slow speed with what it has, with the position loop a move there and back
/// too, a transaction, and the same again. It keeps them where its current does not swing, its error is not larger, a move settles and goes no
/// farther beyond, and `wants_back` is false, which is asked last. Else the drive has in the end what it had.
///
/// # Errors
/// What stopped it, that its gains are others than those that were measured, that a journal of former gains is there already, and that
/// not everything could be put back.
pub async fn try_gains(
    (drive, restorer): (&Drive, &Restorer),
    request: &Request,
    (mut report, proposed): (TuneReport, Proposed),
    excursion: &mut Excursion,
    progress: &impl Progress,
    wants_back: impl Future<Output = bool>,
) -> Result<TuneReport, Failure> {
    let id = drive.node().id();
    let former = request.journal.as_deref().map(former_gains);
    check_no_former(request, id)?;
    check_unchanged(drive, &proposed).await?;
    let sampled = report.period_ms.map(|period_ms| Duration::from_secs_f64(period_ms / 1e3));
    let request = &Request { period: sampled.or(request.period), ..request.clone() };
    let moves = request.with_position && can_move(drive, request);
    if moves != request.with_position {
        let why = "a move is not tried on this drive: it shows no speed or no current, or has no profile position";
        report.notes.push(why.to_owned());
    }
    let tried = if moves { "a step, a slow speed and a move" } else { "a step and a slow speed" };
    progress.show(format!("node {id}: {tried} with the gains that it has"));
    // The first thing that a step does to the current is proportional to it.
    let most_rpm = ENOUGH_CURRENT * request.bounds.current_a / proposed.proportional_a_s_rad / RAD_S_PER_RPM;
    let before = trial((drive, restorer), request, (most_rpm, moves), excursion).await?;
    let undo = proposed.gains.iter().map(|gain| (gain.object, bytes(drive, gain.object, gain.before))).collect();
    // Until the new gains are kept or gone: whatever ends the program meanwhile.
    keep((drive, restorer), former.as_deref(), undo, request.on_kept).await?;
    let after = match write(drive, request, &proposed, progress).await {
        Ok(()) => {
            progress.show(format!("node {id}: the same with the new gains"));
            trial((drive, restorer), request, (most_rpm, moves), excursion).await
        }
        Err(failure) => Err(failure),
    };
    report.peak_a = report.peak_a.max(excursion.peak_a);
    report.travel_turns = report.travel_turns.max(excursion.travel_turns);
    let objection = judged(before, after, request, &mut report, wants_back).await;
    if let Ok(None) = objection {
        report.applied = true;
        let undeleted = restorer.keep_newest().err();
        report.notes.extend(undeleted.map(|failure| noted("the new gains stay", failure)));
        return Ok(report);
    }
    // What a step has written may be there too, where its own way back was not whole.
    let (left, undeleted) = restorer.put_back_written().await;
    let undeleted = undeleted.into_iter().map(|failure| noted("what was written was put back", failure));
    let back = match left.is_empty() {
        true => Ok(()),
        false => {
            let what = format!("node {id}: not everything that was written could be put back");
            Err(with_left(Failure::new(what).of_kind("not_put_back").at_node(id), &left))
        }
    };
    if let (Err(failure), Ok(())) = (&objection, &back) {
        return Err(undeleted.fold(failure.clone().because(BACK), Failure::because));
    }
    report.notes.extend(both(objection, back)?.into_iter().chain(undeleted));
    Ok(report)
}

/// Why the new gains do not stay, after a trial with the former ones and one with them; it is noted in the report.
async fn judged(
    before: Answers,
    after: Result<Answers, Failure>,
    request: &Request,
    report: &mut TuneReport,
    wants_back: impl Future<Output = bool>,
) -> Result<Option<String>, Failure> {
    // Gains that were not seen to hold the shaft do not stay, whatever stopped it.
    let after = after.map_err(|failure| match failure.kind == CURRENT_KIND {
        true => failure.next("ask for gains that take less, e.g. --phase-margin 50"),
        false => failure,
    })?;
    let error = judged_by(&before, &after);
    report.drive_error = Some([error(&before.step), error(&after.step)]);
    if let Some((_, Some(seen))) = &after.moved {
        let what = "with the new gains the shaft was not seen to stand while they held it, and stands without power";
        report.notes.push(format!("{what}: {seen}"));
    }
    let moves = before.moved.as_ref().zip(after.moved.as_ref());
    report.drive_move = moves.map(|((before, _), (after, _))| [*before, *after]);
    let why = objection(&before, &after, request, report).or_else(|| {
        let [before, after] = report.drive_move?;
        let twin = report.twin_move.map(|[_, after]| after);
        after.objection(&before, twin.as_ref(), MORE_THAN_TWIN, request.bounds.speed_rpm)
    });
    report.curves.drive = Some([before.step, after.step]);
    Ok(match why {
        None if wants_back.await => Some(BACK.to_owned()),
        why => why.map(|why| format!("{why}: {BACK}")),
    })
}

/// A step, a slow speed, and a move where the position loop was asked for, with the gains that it has.
async fn trial(
    on: (&Drive, &Restorer),
    request: &Request,
    (most_rpm, moves): (f64, bool),
    excursion: &mut Excursion,
) -> Result<Answers, Failure> {
    let (step, slow_ripple_a) = step(on, request, most_rpm, excursion).await?;
    let moved = if moves { Some(move_there_and_back(on, request, excursion).await?) } else { None };
    Ok(Answers { step, slow_ripple_a, moved })
}

fn can_move(drive: &Drive, request: &Request) -> bool {
    TrialMove::is_possible(drive) && Reader::of(drive, request.bounds, Excursion::default()).is_ok()
}

/// What is led back to are the gains that were measured: nothing has written others since.
async fn check_unchanged(drive: &Drive, proposed: &Proposed) -> Result<(), Failure> {
    for gain in &proposed.gains {
        let found = drive.node().upload(gain.object).await?;
        let (found, measured) = (found.as_bytes(), bytes(drive, gain.object, gain.before));
        if found != measured {
            let id = drive.node().id();
            return Err(Failure::new(format!("node {id}: {} is not what it was when it was measured", gain.object))
                .at_node(id)
                .next("measure it again"));
        }
    }
    Ok(())
}

/// A journal that could not be deleted, which says nothing against what the drive has.
fn noted(what_is: &str, Failure { what, because, next, .. }: Failure) -> String {
    [vec![format!("{what_is}, but {what}")], because, next].concat().join("; ")
}

/// When a drive read its positions decides nothing: where more speed seems wrong, it is looked at without what swings fast. A speed that
/// does so is one whose current does.
fn judged_by(before: &Answers, after: &Answers) -> fn(&StepResponse) -> f64 {
    if after.step.error() > before.step.error() { StepResponse::smooth_error } else { StepResponse::error }
}

/// Why the new gains do not stay.
fn objection(before: &Answers, after: &Answers, request: &Request, report: &TuneReport) -> Option<String> {
    let usual_a = SWINGS * request.bounds.current_a;
    let swings = |ripple_a: f64, most_a: f64, when: &str| {
        let text =
            || format!("its current swings by {ripple_a:.2} A {when} with the new gains, more than {most_a:.2} A");
        (ripple_a > most_a).then(text)
    };
    // The encoder's counts make the current ripple with high gains: on the twin as on the drive.
    let of_twin_a = MORE_THAN_TWIN * report.curves.twin[1].step.ripple_a();
    let slow_a = MORE_THAN_TWIN * before.slow_ripple_a.max(usual_a);
    // A drive that is to be slower than it was may be off by more.
    let is_slower = report.after.crossover_hz < report.before.crossover_hz;
    let error = judged_by(before, after);
    let most_error = match request.objective {
        Objective::PhaseMargin(_) if !is_slower => error(&before.step),
        _ => {
            let (twin, size) = (&report.curves.twin[1].step, |of: &StepResponse| of.step_rpm.1 - of.step_rpm.0);
            error(&before.step).max(MORE_THAN_TWIN * error(twin) * size(&after.step) / size(twin))
        }
    };
    let error = error(&after.step);
    let is_off = || {
        let text =
            || format!("its error after a step is {error:.2} r/min s with the new gains, more than {most_error:.2}");
        (error > most_error).then(text)
    };
    swings(after.step.ripple_a(), before.step.ripple_a().max(usual_a).max(of_twin_a), "after a step")
        .or_else(|| swings(after.slow_ripple_a, slow_a, "at a slow speed"))
        .or_else(is_off)
}

/// How the drive itself answers a step of its set-point, of this size at most, with the gains that it has, and by how much its current
/// swings at a slow speed, A: 0 where that is not seen. What was written for that is put back.
///
/// # Errors
/// What stopped it, and that not everything could be put back.
pub async fn step(
    (drive, restorer): (&Drive, &Restorer),
    request: &Request,
    most_rpm: f64,
    excursion: &mut Excursion,
) -> Result<(StepResponse, f64), Failure> {
    let (model, loops) = loops_of(drive)?;
    let (journal, on_kept) = (request.journal.as_deref(), request.on_kept);
    let setup = Setup::begin((drive, restorer), (model, loops), &[], journal, on_kept).await?;
    restorer.begin_motion(loops.demand.is_some());
    let answer = async {
        setup.prepare(drive, 1.0).await?;
        if loops.demand.is_none() {
            let mut reader = Reader::of(drive, request.bounds, *excursion)?;
            reader.guard(request.cyclic.guard).await?;
            let answer = reader.step_response(most_rpm, Duration::from_secs_f64(ANSWER_S)).await;
            *excursion = reader.excursion;
            return both(answer.map(|answer| (answer, 0.0)), reader.stop().await);
        }
        let period = request.period.unwrap_or(SAMPLE_PERIODS[0]);
        let mut bench = Bench::open(drive, loops, period, request.bounds, request.cyclic, *excursion).await?;
        let answer = match bench.step_response(most_rpm, ANSWER_S).await {
            Ok(step) => bench.slow_ripple_a().await.map(|slow_ripple_a| (step, slow_ripple_a)),
            Err(failure) => Err(failure),
        };
        *excursion = bench.excursion;
        both(answer, bench.stop().await)
    };
    let answer = answer.await;
    both(answer, setup.put_back(drive).await)
}

/// How the drive itself moves with the gains that it has, there and back; and what was seen of a shaft that came to stand without power
/// alone. What was written for that is put back.
///
/// # Errors
/// What stopped it, and that not everything could be put back.
pub async fn move_there_and_back(
    (drive, restorer): (&Drive, &Restorer),
    request: &Request,
    excursion: &mut Excursion,
) -> Result<(MoveRow, Option<Failure>), Failure> {
    let (model, loops) = loops_of(drive)?;
    let mut reader = Reader::of(drive, request.bounds, *excursion)?;
    let (journal, on_kept) = (request.journal.as_deref(), request.on_kept);
    let setup = Setup::begin((drive, restorer), (model, loops), &WRITTEN, journal, on_kept).await?;
    restorer.begin_motion(false);
    let row = async {
        setup.prepare(drive, 1.0).await?;
        reader.guard(request.cyclic.guard).await?;
        let row = reader.moves(TrialMove::new(request.bounds.speed_rpm)).await;
        *excursion = reader.excursion;
        match reader.stop_and_let_go().await {
            Ok(seen) => row.map(|row| (row, seen)),
            Err(failure) => both(row.map(|row| (row, None)), Err(failure)),
        }
    };
    let row = row.await;
    both(row, setup.put_back(drive).await)
}

/// Where the former gains are kept, beside the journal of a transaction.
fn former_gains(journal: &Path) -> PathBuf {
    journal.with_extension("gains.journal")
}

/// The proposed values as a transaction. Its way back is that of the former gains.
async fn write(drive: &Drive, request: &Request, proposed: &Proposed, progress: &impl Progress) -> Result<(), Failure> {
    let mut wanted = Parameters::default();
    for gain in &proposed.gains {
        wanted.values.insert(gain.object, bytes(drive, gain.object, gain.after));
    }
    let (within, on_kept) = (request.within, request.on_kept);
    let transaction = Transaction { address: false, save: false, prove: None, within, journal: None, on_kept };
    transaction.apply(progress, drive, &wanted, "proposed gains".to_owned()).await.map(drop)
}
