//! The World view: changes of the surroundings of virtual drives, their history and undo, and the true state of everything.

pub(crate) mod changes;
pub(crate) mod door;

use can::Instant;
use canopen::NodeId;
use serde_json::{Value, json};

use crate::answer::Answer;
use crate::around::Changed;
use crate::state::Host;
use crate::work::{Asked, Done, send};
use crate::world::door::NoAnswer;

/// Longest line in bytes: many times the longest useful one.
const LONGEST_LINE: usize = 400;

impl Host {
    /// The usage texts of the commands.
    pub(crate) fn send_world_forms(&mut self, asked: Asked) {
        let Some(world) = &self.setting.world else {
            let (seq, answer) = asked;
            return send(answer, Answer::known(seq, json!({ "is_virtual": false, "forms": [] })));
        };
        let forms = world.forms();
        self.work.push(Box::pin(async move {
            let forms = forms.await.map(|forms| json!({ "is_virtual": true, "forms": forms }));
            Done::LookedAround(asked, forms)
        }));
    }

    /// The true state of everything, and the changes after the one with this number.
    pub(crate) fn look_around(&mut self, after: Option<u64>, asked: Asked) {
        let Some(world) = &self.setting.world else { return no_world(asked) };
        let looked = world.look();
        let changes: Value = self.changes.after(after).map(|change| json!(change)).collect();
        self.work.push(Box::pin(async move {
            let seen = looked.await.map(|mut seen| {
                seen["changes"] = changes;
                seen
            });
            Done::LookedAround(asked, seen)
        }));
    }

    /// Executes a command line.
    pub(crate) fn change_world(&mut self, line: String, asked: Asked) {
        let Some(world) = &self.setting.world else { return no_world(asked) };
        if line.len() > LONGEST_LINE {
            let (seq, answer) = asked;
            let text = format!("the line is longer than {LONGEST_LINE} bytes; expected a command such as 4 supply 30");
            return send(answer, Answer::failed(Some(seq), "usage", text));
        }
        let done = world.change(line);
        self.work.push(Box::pin(async move { Done::WorldChanged(asked, done.await) }));
    }

    pub(crate) fn conclude_change(
        &mut self,
        (seq, answer): Asked,
        done: Result<Result<Changed, (&'static str, String)>, NoAnswer>,
    ) {
        let changed = match done {
            Ok(Ok(changed)) => changed,
            Ok(Err((kind, why))) => return send(answer, Answer::failed(Some(seq), kind, why)),
            Err(NoAnswer) => return send(answer, busy(seq)),
        };
        let time_s = (self.network.now() - Instant::ZERO).as_secs_f64();
        self.send_news(changed.node.and_then(NodeId::new), &format!("world: {}", changed.line));
        let notes = changed.note.iter().cloned().collect();
        self.changes.add(time_s, changed);
        send(answer, Answer::done(seq, notes));
    }
}

/// Answers with the state of the world.
pub(crate) fn conclude_looking_around((seq, answer): Asked, seen: Result<Value, NoAnswer>) {
    send(answer, seen.map_or_else(|NoAnswer| busy(seq), |seen| Answer::known(seq, seen)));
}

fn no_world((seq, answer): Asked) {
    let text = "these drives are real, or belong to another program: connect to a running simulator with `ferrodrive studio --control`";
    send(answer, Answer::failed(Some(seq), "no_world", text));
}

fn busy(seq: u64) -> Answer {
    Answer::failed(Some(seq), "busy", "the world is busy, or has ended: try again")
}
