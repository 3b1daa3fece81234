//! Parameters of virtual drives: reads, writes, refusals and rollbacks.
//!
//! Figures: ZLAC8030L quick start guide V1.00, chapter 9: 6081h is 120 r/min by default and takes 1 to 1000, 6083h is
//! 500 ms and takes 0 to 32767, 2008h is 1 r/min and is stored, 2009h restores or stores.

use std::sync::{Arc, Mutex};

use canopen::{Mux, NodeId};
use cia402::object::{PROFILE_ACCELERATION, PROFILE_VELOCITY};
use machine::parameters::journal::Journal;
use serde_json::Value;

use master::drive;

use super::{Page, Stage, WHEEL, play, play_with, to, velocity};
use crate::Journals;
use crate::command::{Command, FileForm, NewValue, NodeCommand, ParameterChange, ParameterReading, SessionCommand};

fn setting(object: &str, value: &str) -> Command {
    let values = vec![NewValue { object: object.into(), value: value.into() }];
    NodeCommand::Change(ParameterChange::WriteParameters { values, file: None }).to(WHEEL)
}

impl Stage {
    async fn initial_speed(&self) -> u16 {
        self.network.node(WHEEL).read(Mux::new(0x2008, 0)).await.expect("it answers")
    }

    async fn has(&self, object: Mux) -> u32 {
        self.network.node(WHEEL).read(object).await.expect("it answers")
    }
}

impl Page {
    async fn answer(&mut self, command: Command) -> Value {
        serde_json::from_str(&self.ask(command).await.json()).expect("JSON")
    }

    /// The result of a command that has to succeed.
    pub(super) async fn knows(&mut self, command: impl Into<Command>) -> Value {
        let shown = self.answer(command.into()).await;
        assert_eq!(shown["ok"], true, "{shown}");
        shown["result"].clone()
    }

    /// The kind and the text of a refusal.
    pub(super) async fn refused(&mut self, command: impl Into<Command>) -> (String, String) {
        let shown = self.answer(command.into()).await;
        assert_eq!(shown["ok"], false, "{shown}");
        let text = |name: &str| shown["error"][name].as_str().expect("text").to_owned();
        (text("kind"), text("message"))
    }
}

#[test]
fn a_parameter_is_changed_read_back_and_rolled_back() {
    play(async |stage| {
        let mut page = stage.page().await;
        let read = |objects: &[&str]| {
            let objects = objects.iter().map(|&object| object.to_owned()).collect();
            NodeCommand::Read(ParameterReading::ReadObjects { objects }).to(WHEEL)
        };
        let (kind, _) = page.refused(setting("6081h:00", "60rpm")).await;
        assert_eq!((kind.as_str(), stage.has(PROFILE_VELOCITY).await), ("not_in_control", 120));
        page.must(SessionCommand::TakeControl {}).await;
        let done = page.knows(setting("6081h:00", "60rpm")).await;
        assert_eq!((&done["steps"][0]["object"], stage.has(PROFILE_VELOCITY).await), (&"6081h:00".into(), 60));
        page.knows(setting("6083", "700")).await;
        let values = page.knows(read(&["6081h:00", "6083h:00", "1000h:00"])).await;
        let is_default = |at: usize| values["values"][at]["is_default"].clone();
        assert_eq!(
            [is_default(0), is_default(1), is_default(2)].map(|shown| shown.as_bool()),
            [Some(false), Some(false), Some(true)],
            "{values}"
        );
        assert_eq!(page.knows(NodeCommand::Change(ParameterChange::RollBack {}).to(WHEEL)).await["can_roll_back"], 1);
        assert_eq!((stage.has(PROFILE_VELOCITY).await, stage.has(PROFILE_ACCELERATION).await), (60, 500));
        page.knows(NodeCommand::Change(ParameterChange::RollBack {}).to(WHEEL)).await;
        assert_eq!(stage.has(PROFILE_VELOCITY).await, 120);
        assert_eq!(
            page.refused(NodeCommand::Change(ParameterChange::RollBack {}).to(WHEEL)).await.0,
            "nothing_to_roll_back"
        );
    });
}

#[test]
fn invalid_values_and_commands_are_not_written() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        for (object, value, kind, words) in [
            ("6081", "1001", "unfit_parameters", "1 to 1000"),
            ("6081", "-1", "bad_value", "does not fit"),
            ("6081", "fast", "bad_value", "fast"),
            ("6041", "1", "unfit_parameters", "only be read"),
            ("60FF", "60", "not_a_parameter", "Motion"),
            ("6040", "15", "not_a_parameter", "Motion"),
            ("6060", "3", "not_a_parameter", "Motion"),
            ("2009", "1", "not_a_parameter", "Motion"),
            ("5FFF", "1", "unknown_object", "not in the description"),
        ] {
            let (found, text) = page.refused(setting(object, value)).await;
            assert!(found == kind && text.contains(words), "{object}: {found}: {text}");
        }
        assert_eq!(stage.has(PROFILE_VELOCITY).await, 120);
        let neither =
            NodeCommand::Change(ParameterChange::WriteParameters { values: Vec::new(), file: None }).to(WHEEL);
        assert_eq!(page.refused(neither).await.0, "malformed");
        page.must(to(WHEEL, drive::Command::Enable)).await;
        assert_eq!(page.refused(setting("6081", "60")).await.0, "at_work");
        assert_eq!(stage.has(PROFILE_VELOCITY).await, 120);
        page.must(to(WHEEL, drive::Command::Disable)).await;
        page.knows(setting("6081", "60")).await;
    });
}

#[test]
fn a_file_is_saved_compared_planned_and_applied_as_a_whole() {
    play(async |stage| {
        let mut page = stage.page().await;
        let mut backed_up = async |form| {
            let answer = page.knows(NodeCommand::Read(ParameterReading::BackUp { form }).to(WHEEL)).await;
            answer["file"].as_str().expect("text").to_owned()
        };
        let file = backed_up(FileForm::Toml).await;
        // The same values, in a format of other tools.
        let other = machine::parameters::of_dcf(backed_up(FileForm::Dcf).await.as_bytes(), WHEEL).expect("a DCF");
        let model = &devices::zltech::zlac8030l::ZLAC8030L;
        assert_eq!(other.values, machine::parameters::sheet::parse(&file, Some(model)).expect("parameters").values);
        page.must(SessionCommand::TakeControl {}).await;
        page.knows(setting("2008", "60rpm")).await;
        let compared =
            page.knows(NodeCommand::Read(ParameterReading::CompareParameters { file: file.clone() }).to(WHEEL)).await;
        let others: Vec<_> =
            compared["objects"].as_array().expect("rows").iter().filter(|row| row["drive_is_file"] == false).collect();
        assert_eq!((others.len(), &others[0]["object"]), (1, &"2008h:00".into()), "{others:?}");
        let plan = NodeCommand::Read(ParameterReading::PlanParameters { values: Vec::new(), file: Some(file.clone()) })
            .to(WHEEL);
        let plan = page.knows(plan).await;
        assert_eq!((plan["steps"].as_array().map(Vec::len), stage.initial_speed().await), (Some(1), 60), "{plan}");
        page.knows(
            NodeCommand::Change(ParameterChange::WriteParameters { values: Vec::new(), file: Some(file) }).to(WHEEL),
        )
        .await;
        assert_eq!(stage.initial_speed().await, 1);
        let broken =
            |file: &str| NodeCommand::Read(ParameterReading::CompareParameters { file: file.into() }).to(WHEEL);
        assert_eq!(page.refused(broken("[values]\nno_such_object = 1")).await.0, "bad_parameters");
        // One value of two is beyond its limits: neither is written.
        let file = "[values]\n\"6083\" = 700\n\"6081\" = 5000".to_owned();
        let both =
            NodeCommand::Change(ParameterChange::WriteParameters { values: Vec::new(), file: Some(file) }).to(WHEEL);
        assert_eq!(page.refused(both).await.0, "bad_parameters");
        assert_eq!((stage.has(PROFILE_VELOCITY).await, stage.has(PROFILE_ACCELERATION).await), (120, 500));
    });
}

#[test]
fn a_transaction_is_completed_without_its_page_and_the_drive_is_not_enabled_meanwhile() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        let file = "[values]\n\"6083\" = 700\n\"6084\" = 700\n\"6081\" = 60".to_owned();
        let write =
            NodeCommand::Change(ParameterChange::WriteParameters { values: Vec::new(), file: Some(file) }).to(WHEEL);
        page.seq += 1;
        let unheard = page.session.ask(page.seq, write).expect("there is room");
        assert_eq!(page.refused(to(WHEEL, drive::Command::Enable)).await.0, "busy");
        assert_eq!(page.refused(setting("6081", "70")).await.0, "busy");
        drop((unheard, page));
        stage.sleep(2000).await;
        assert_eq!((stage.has(PROFILE_VELOCITY).await, stage.has(PROFILE_ACCELERATION).await), (60, 700));
    });
}

/// A store of journals that records its calls; one with a full disk saves none.
#[derive(Debug, Default)]
struct Keeper {
    shown: Mutex<Vec<String>>,
    is_full: bool,
    keeps_all: bool,
}

impl Journals for Keeper {
    fn begin(&self, journal: &Journal) -> Result<(), String> {
        if self.is_full {
            return Err("the disk is full".into());
        }
        self.shown.lock().expect("whole").push(format!("{} undoes {}", journal.node, journal.undo.len()));
        Ok(())
    }

    fn end(&self, node: NodeId) -> Result<(), String> {
        self.shown.lock().expect("whole").push(format!("{node} is done"));
        if self.keeps_all { Err("the journal could not be deleted".into()) } else { Ok(()) }
    }
}

#[test]
fn a_journal_is_kept_from_the_first_write_to_the_last_and_without_it_nothing_is_written() {
    let keeper = Arc::new(Keeper::default());
    play_with(keeper.clone(), async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        page.knows(setting("6081h:00", "60rpm")).await;
        // Nothing to write, and nothing that may be written.
        page.knows(setting("6081h:00", "60rpm")).await;
        page.refused(setting("6081h:00", "5000")).await;
        page.knows(NodeCommand::Change(ParameterChange::RollBack {}).to(WHEEL)).await;
    });
    let shown = keeper.shown.lock().expect("whole").clone();
    assert_eq!(shown, ["4 undoes 1", "4 is done", "4 undoes 1", "4 is done"]);
    play_with(Arc::new(Keeper { is_full: true, ..Keeper::default() }), async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        let (kind, text) = page.refused(setting("6081h:00", "60rpm")).await;
        assert_eq!((kind.as_str(), text.as_str()), ("journal", "nothing was written: the disk is full"));
        assert_eq!(stage.has(PROFILE_VELOCITY).await, 120);
    });
}

#[test]
fn a_journal_that_cannot_be_deleted_is_news_for_every_page_and_the_write_holds() {
    play_with(Arc::new(Keeper { keeps_all: true, ..Keeper::default() }), async |stage| {
        let (mut page, mut news) = (stage.page().await, stage.handle.news());
        page.must(SessionCommand::TakeControl {}).await;
        let done = page.knows(setting("6081h:00", "60rpm")).await;
        assert_eq!(
            (&done["journal"], stage.has(PROFILE_VELOCITY).await),
            (&"the journal could not be deleted".into(), 60)
        );
        let heard: Vec<String> = std::iter::from_fn(|| news.try_recv().ok()).map(|news| news.text).collect();
        assert!(heard.iter().any(|news| news.contains("could not be deleted")), "{heard:?}");
    });
}

/// The steps of the tour: a parameter that causes a fault, its rollback, and the store. ZLAC8030L quick start
/// guide V1.00, chapters 8 and 9: 2013h:01 is the motor's temperature threshold in 0.1 degC, fault 0800h.
#[test]
fn the_steps_of_the_tour_work_and_are_seen_in_the_state() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        let shown = |stage: &Stage, field: &str| stage.state()["nodes"][1][field].clone();
        let threshold = NewValue { object: "2013:01".into(), value: "100".into() };
        page.must(
            NodeCommand::Change(ParameterChange::WriteParameters { values: vec![threshold], file: None }).to(WHEEL),
        )
        .await;
        stage.sleep(500).await;
        assert_eq!(shown(stage, "can_roll_back"), 1);
        assert_ne!(shown(stage, "drive")["fault_code"], 0, "the motor is warmer than 10 degC");
        page.must(NodeCommand::Change(ParameterChange::RollBack {}).to(WHEEL)).await;
        page.must(to(WHEEL, drive::Command::ResetFault)).await;
        stage.sleep(500).await;
        assert_eq!((shown(stage, "can_roll_back"), &shown(stage, "drive")["fault_code"]), (0.into(), &0.into()));
        page.must(velocity(WHEEL, 30.0)).await;
        assert_eq!(
            page.ask(NodeCommand::Change(ParameterChange::Store {}).to(WHEEL)).await.error_kind(),
            "busy",
            "it turns"
        );
        page.must(to(WHEEL, drive::Command::Disable)).await;
        assert_eq!(shown(stage, "stored"), 0);
        page.must(NodeCommand::Change(ParameterChange::Store {}).to(WHEEL)).await;
        stage.sleep(500).await;
        assert_eq!(shown(stage, "stored"), 1);
    });
}
