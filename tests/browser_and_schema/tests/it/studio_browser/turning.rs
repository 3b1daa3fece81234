//! What turns the wheel, however busy the machine is.

use std::cell::Cell;
use std::time::Instant;

use serde_json::Value;

use super::{RETRY, Stage, WHEEL, speed};

fn wheel_turns(state: &Value) -> bool {
    speed(&state["nodes"][WHEEL]) > 50.0
}

impl Stage {
    /// Commands a speed until the wheel turns.
    pub(super) async fn turn(&self) {
        self.turns_by(wheel_turns, async || self.click("#go-turn").await).await;
    }

    /// Presses this until the wheel turns.
    pub(super) async fn jog(&self, press: impl AsyncFn()) {
        self.press_until(wheel_turns, press).await;
    }

    /// Presses this until what it is to turn turns.
    pub(super) async fn press_until(&self, turns: impl Fn(&Value) -> bool, press: impl AsyncFn()) {
        self.turns_by(turns, async || {
            self.client.release_actions().await.expect("a release");
            self.sees().await;
            press().await;
        })
        .await;
    }

    /// Does this until something turns; again where the page of a busy machine has sent nothing, its state stale, or has let go.
    async fn turns_by(&self, turns: impl Fn(&Value) -> bool, does: impl AsyncFn()) {
        let done = Cell::new(None::<Instant>);
        self.until("what is to turn", async || {
            if done.get().is_none_or(|at| at.elapsed() > RETRY) {
                does().await;
                // When it may be done again.
                done.set(Some(Instant::now()));
            }
            turns(&self.studio.state())
        })
        .await;
    }
}
