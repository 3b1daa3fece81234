//! The speed limit of a session, against programs that request more than a page would.

use cia402::PowerState;

use super::{ARM, WHEEL, home, jog, move_by, play, torque, velocity};
use crate::command::{AxisSpeed, AxisTarget, BaseJog, Command, GroupCommand, GroupMove, SessionCommand};

const LIMIT_RPM: f64 = 20.0;

/// Commands that turn a drive faster than the limit, or may.
fn too_fast() -> Vec<Command> {
    let axes = |degrees| [WHEEL, ARM].map(|node| AxisTarget { node, degrees }).to_vec();
    let speeds = |rpm| vec![AxisSpeed { node: WHEEL, rpm: 1.0 }, AxisSpeed { node: ARM, rpm }];
    let group = |rpm| GroupMove { axes: axes(90.0), relative: true, rpm, rpm_per_s: None, within_s: None };
    vec![
        jog(20.1),
        jog(-20.1),
        jog(f64::NAN),
        velocity(WHEEL, -21.0),
        move_by(WHEEL, 90.0, Some(60.0)),
        // The drive is set to 120 r/min by default.
        move_by(WHEEL, 90.0, None),
        home(ARM, 17, None),
        home(ARM, 17, Some(21.0)),
        torque(WHEEL, 0.1),
        GroupCommand::GroupMove(group(None)).into(),
        GroupCommand::GroupMove(group(Some(25.0))).into(),
        GroupCommand::GroupJog { axes: speeds(-25.0), rpm_per_s: None }.into(),
        GroupCommand::GroupJog { axes: speeds(f64::NAN), rpm_per_s: None }.into(),
        GroupCommand::BaseJog(base(0.22)).into(),
    ]
}

/// A wheel of 0.1 m: 20 r/min are 2 pi 0.1 m / 3 s = 0.2094 m/s.
fn base(most_m_s: f64) -> BaseJog {
    BaseJog {
        wheels: [WHEEL, ARM],
        turns: [1.0, -1.0],
        wheel_base_m: 0.5,
        wheel_radius_m: 0.1,
        most_m_s,
        m_per_s2: 0.5,
        linear_m_s: 0.0,
        angular_rad_s: 0.0,
    }
}

#[test]
fn no_motion_beyond_the_limit_of_a_session_is_started() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::LimitSpeed { rpm: Some(LIMIT_RPM) }).await;
        page.take_control_of_all().await;
        for command in too_fast() {
            let answer = page.ask(command.clone()).await;
            assert_eq!(answer.error_kind(), "speed_limit", "{command:?}: {}", answer.json());
            assert!(answer.json().contains("speed limit of this session, 20 r/min"), "{}", answer.json());
            for node in [WHEEL, ARM] {
                assert_eq!(
                    stage.power_state(node).await,
                    PowerState::SwitchOnDisabled,
                    "{command:?} has not even enabled {node}"
                );
            }
        }
        assert!(stage.network.moved().is_empty());
        stage.sleep(100).await;
        assert_eq!(stage.state()["speed_limit_rpm"], LIMIT_RPM);
        // A motion within the limit turns.
        page.must(velocity(WHEEL, -20.0)).await;
        stage.turns(WHEEL, 20.0).await;
        page.must(SessionCommand::StopAll {}).await;
        stage.rests(WHEEL).await;
        assert_ne!(page.ask(GroupCommand::BaseJog(base(0.20))).await.error_kind(), "speed_limit");
        page.must(SessionCommand::LimitSpeed { rpm: None }).await;
        page.must(velocity(WHEEL, 60.0)).await;
        stage.turns(WHEEL, 60.0).await;
    });
}

#[test]
fn a_lower_limit_stops_a_motion_from_before() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.take_control_of_all().await;
        page.must(velocity(WHEEL, 60.0)).await;
        stage.turns(WHEEL, 60.0).await;
        for rpm in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(
                page.ask(SessionCommand::LimitSpeed { rpm: Some(rpm) }).await.error_kind(),
                "malformed",
                "{rpm}"
            );
        }
        stage.turns(WHEEL, 60.0).await;
        page.must(SessionCommand::LimitSpeed { rpm: Some(30.0) }).await;
        stage.rests(WHEEL).await;
        // A higher limit stops nothing, and neither does that of a page without control.
        page.must(velocity(WHEEL, 30.0)).await;
        stage.turns(WHEEL, 30.0).await;
        page.must(SessionCommand::LimitSpeed { rpm: Some(60.0) }).await;
        let mut other = stage.page().await;
        other.must(SessionCommand::LimitSpeed { rpm: Some(1.0) }).await;
        for _ in 0..20 {
            stage.sleep(50).await;
            page.must(SessionCommand::Alive {}).await;
        }
        assert!((stage.speed(WHEEL).await - 30.0).abs() < 5.0);
        assert_eq!(stage.state()["speed_limit_rpm"], 60.0, "that of the session in control");
        // The session that gets control has its own limit, from before.
        page.must(SessionCommand::HandOver { to: other.session.id().0 }).await;
        stage.rests(WHEEL).await;
        assert_eq!(other.ask(jog(2.0)).await.error_kind(), "speed_limit");
    });
}
