//! What moves a drive to measure it, in a real browser: a test motion to its end, and a search for gains that is stopped. What of it is
//! measured is held by the host's own tests, in virtual time.

use super::Stage;

impl Stage {
    /// Opens a form of the Scope view.
    async fn form(&self, id: &str) {
        self.click("#tabs [data-name=scope]").await;
        self.find(&format!("#{id}")).await;
        let open = "document.getElementById(arguments[0]).open = true";
        self.client.execute(open, vec![id.into()]).await.expect("it opens");
    }

    async fn text(&self, css: &str) -> String {
        let text = "return document.querySelector(arguments[0]).textContent";
        let text = self.client.execute(text, vec![css.into()]).await.expect("it runs");
        text.as_str().expect("a text").to_owned()
    }
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn a_test_motion_is_run_and_a_search_for_gains_is_stopped() {
    let stage = Stage::open("measuring").await;
    stage.take_the_wheel().await;
    stage.form("test-motion").await;
    stage.fill("#test-count", "1").await;
    stage.has_done("#test-start", "#test-status", "The drive stands without power").await;
    stage.says("#test-had", "rise, 0 to 60 r/min").await;
    stage.shoot("test_motion").await;
    stage.is_usable("a test motion").await;
    stage.identifies_from_a_file().await;
    stage.form("tune").await;
    // What is going to happen is said, with the limits, and has to be agreed to.
    let warning = stage.says("#tune-warning", "120 r/min at most").await;
    assert!(warning.contains("40 turns") && warning.contains("15 A"), "{warning}");
    stage.find("#tune-start:disabled").await;
    stage.click_for("#tune-agreed", "#tune-agreed[aria-pressed=true]").await;
    stage.shoot("tune").await;
    // A program that is late ends it by itself.
    stage.has_begun_to_tune().await;
    stage
        .until("it is stopped", async || {
            let stop = "const stop = document.querySelector('#tune-stop'); if (!stop.hidden) stop.click()";
            stage.client.execute(stop, Vec::new()).await.expect("it runs");
            stage.text("#tune-status").await.contains("stopped") && stage.text("#tune-phase").await.is_empty()
        })
        .await;
    stage.find("#tune-write[hidden]").await;
    stage.close().await;
}

impl Stage {
    /// A record of a wheel of 0.02 kg m² without friction, of a motor with the torque constant of a delivered ZLAC8030L (0.761 N m/A), driven
    /// by a current with a random sign every 8 ms: between two samples it is evenly accelerated.
    async fn identifies_from_a_file(&self) {
        let mut csv = "t_s,4.current_demand_a,4.position_deg,mark\n0,,,\"capture {\"\"model\"\":\"\"zlac8030l\"\"}\"\n"
            .to_owned();
        let (mut angle, mut speed, mut current, mut bits) = (0.0_f64, 10.0, 1.0, 1_u32);
        for row in 0..8000 {
            if row % 8 == 0 {
                // A linear congruential generator (D. E. Knuth, "The Art of Computer Programming" 2, 3.2.1).
                bits = bits.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                current = if bits >> 31 == 0 { 0.5 } else { -0.5 };
            }
            csv += &format!("{},{current},{},\n", f64::from(row) * 1e-3, angle.to_degrees());
            let gained = 0.761 * current / 0.02 * 1e-3;
            angle += (speed + gained / 2.0) * 1e-3;
            speed += gained;
        }
        let file = self.profile.write("wheel.csv", &csv);
        self.find("#capture-file").await.send_keys(&file).await.expect("it is chosen");
        self.click("[data-capture='wheel.csv'] button[aria-label^=Identify]").await;
        self.says("#identified", "Coherent").await;
        let found = self.text("#identified table").await;
        assert!(found.contains("Inertia0.02 kg·m²") || found.contains("Inertia0.0200 kg·m²"), "{found}");
        self.shoot("identified").await;
        self.is_usable("what was identified").await;
    }

    /// Presses *Measure* until the studio has taken it: a page of a busy machine sends nothing while its state is stale.
    async fn has_begun_to_tune(&self) {
        self.until("it has begun", async || {
            let press = "const of = (id) => document.querySelector(id); of('#take')?.click(); \
                         if (of('#tune-agreed').getAttribute('aria-pressed') === 'false') of('#tune-agreed').click(); \
                         if (!of('#tune-start').disabled) of('#tune-start').click()";
            let (phase, status) = (self.text("#tune-phase").await, self.text("#tune-status").await);
            if !phase.is_empty() || status.contains("measurement was stopped") {
                return true;
            }
            self.client.execute(press, Vec::new()).await.expect("it runs");
            false
        })
        .await;
    }
}
