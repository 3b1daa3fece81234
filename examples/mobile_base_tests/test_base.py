"""A mobile base is tested: what it does with its wheels, and what it does when something breaks."""

import math
import time

import can
import ferrodrive
import pytest
from base import LEFT, RIGHT, WHEEL_BASE_M, WHEEL_RADIUS_M, Base, Fault

#: 0.5 m/s with wheels of 84 mm.
ROLLING_RPM = 0.5 / (2 * math.pi * WHEEL_RADIUS_M) * 60

#: Of base.toml: rolling friction as a share of the weight.
ROLLING = 0.015
#: Gravity, m/s².
G = 9.80665


def until(condition, within_s):
    """Waits, in whatever time the test runs in."""
    end = time.monotonic() + within_s
    while not condition():
        assert time.monotonic() < end, f"not so within {within_s} s"
        time.sleep(0.01)


def stop(base):
    """Brings the base to a stand; its wheels swing a little, for it has mass."""
    base.drive(0)
    time.sleep(1.5)


def leg(base, world, speed_m_s, turning_rad_s):
    """Two seconds with these set-points, from stand to stand; how far each wheel truly rolled, in m."""
    before = rolled_m(world)
    base.drive(speed_m_s, turning_rad_s)
    time.sleep(2)
    stop(base)
    return [now - then for now, then in zip(rolled_m(world), before)]


def closed_form(legs):
    """Where wheels that roll such arcs, left and right in m, bring a base: each leg is an arc of a circle, and its chord points along
    the heading in its middle. x and y in m, heading in rad."""
    x_m = y_m = heading = 0.0
    for left, right in legs:
        turn = (right - left) / WHEEL_BASE_M
        chord = (left + right) / 2 * (math.sin(turn / 2) / (turn / 2) if turn else 1)
        x_m += chord * math.cos(heading + turn / 2)
        y_m += chord * math.sin(heading + turn / 2)
        heading += turn
    return x_m, y_m, heading


def rolled_m(world):
    return [world[wheel].shaft_angle_rad * WHEEL_RADIUS_M for wheel in (LEFT, RIGHT)]


def turning(world):
    return [abs(world[wheel].velocity_rpm) for wheel in (LEFT, RIGHT)]


def test_set_points_by_pdo_turn_both_wheels_at_the_wanted_speed(rolling, world):
    time.sleep(2)
    assert turning(world) == pytest.approx([ROLLING_RPM] * 2, rel=0.05)
    rolling.drive(-0.25)
    time.sleep(2)
    assert world[LEFT].velocity_rpm == pytest.approx(-ROLLING_RPM / 2, rel=0.05)


def test_every_sync_is_answered_by_both_wheels(rolling, world):
    with can.Bus(**listener(rolling)) as bus:
        heard = {0x080: 0, 0x181: 0, 0x182: 0}
        while heard[0x080] < 101:
            message = bus.recv(1)
            if message.arbitration_id in heard and (heard[0x080] or message.arbitration_id == 0x080):
                heard[message.arbitration_id] += 1
    assert heard[0x181] == heard[0x182] == 100


def test_odometry_is_the_true_pose_and_that_of_the_closed_form(base, world):
    base.start()
    # Straight on, a turn on the spot, straight on.
    legs = [leg(base, world, *set_points) for set_points in ((0.5, 0), (0, 0.8), (0.4, 0))]
    x_m, y_m, heading = closed_form(legs)
    true = world.body("base").state()
    assert heading > 1.5 and y_m > 0.7
    assert max(map(abs, true["slip_m"])) < 0.001
    assert (true["x_m"], true["y_m"]) == pytest.approx((x_m, y_m), abs=0.005)
    assert math.radians(true["heading_deg"]) == pytest.approx(heading, abs=0.001)
    # One count of an encoder is 0.13 mm on the ground.
    assert (base.x_m, base.y_m) == pytest.approx((true["x_m"], true["y_m"]), abs=0.002)
    assert base.heading_rad == pytest.approx(math.radians(true["heading_deg"]), abs=0.002)


def test_a_steady_arc_is_the_circle_that_the_wheels_make(rolling, world):
    rolling.drive(0.4, 0.8)
    time.sleep(2)
    begin, rolled = world.body("base").state(), rolled_m(world)
    time.sleep(2)
    end = world.body("base").state()
    left, right = (now - before for now, before in zip(rolled_m(world), rolled))
    heading = (right - left) / WHEEL_BASE_M
    radius = (left + right) / 2 / heading
    chord = math.hypot(end["x_m"] - begin["x_m"], end["y_m"] - begin["y_m"])
    assert chord == pytest.approx(2 * radius * math.sin(heading / 2), abs=0.001)
    # The drives take whole r/min: 27 and 64 instead of 27.3 and 63.7.
    assert radius == pytest.approx(WHEEL_BASE_M / 2 * (64 + 27) / (64 - 27), rel=0.01)


def test_on_ice_the_base_lags_as_its_grip_says_and_odometry_is_off_by_the_slip(base, world):
    body = world.body("base")
    body.set_grip(0.03)
    base.start()
    base.drive(0.5)
    time.sleep(1)
    begin = body.state()
    time.sleep(1)
    end = body.state()
    # Both wheels slip: the ground gives grip times weight, and rolling takes its share of that.
    assert begin["slips"] == end["slips"] == [True, True]
    assert end["speed_m_s"] - begin["speed_m_s"] == pytest.approx((0.03 - ROLLING) * G, rel=0.02)
    assert turning(world) == pytest.approx([ROLLING_RPM] * 2, rel=0.05)
    time.sleep(1)
    stop(base)
    time.sleep(1)
    true = body.state()
    assert true["speed_m_s"] == 0
    slip_m = sum(true["slip_m"]) / 2
    assert base.x_m - true["x_m"] == pytest.approx(slip_m, abs=0.005)
    assert slip_m > 0.2


def test_on_a_slope_that_is_too_steep_the_base_slides_and_odometry_does_not_know(base, world):
    body = world.body("base")
    base.start()
    base.drive(0)
    time.sleep(0.5)
    body.set_grip(0.1)
    body.set_slope(8)
    time.sleep(0.2)
    begin = body.state()
    time.sleep(1)
    end = body.state()
    slope = math.radians(8)
    downhill = G * (math.sin(slope) - (0.1 + ROLLING) * math.cos(slope))
    assert end["speed_m_s"] - begin["speed_m_s"] == pytest.approx(-downhill, rel=0.02)
    assert end["x_m"] < -0.1
    # The drives hold the wheels but for what they give way before they do, and the controller sees nothing but those.
    assert base.x_m == pytest.approx(sum(rolled_m(world)) / 2, abs=0.001)
    assert abs(base.x_m) < 0.02


def test_an_emergency_stop_brings_both_wheels_to_a_stand(rolling, world):
    time.sleep(2)
    rolling.emergency_stop()
    until(lambda: max(turning(world)) < 1, 2)
    time.sleep(1)
    assert max(turning(world)) < 1


def test_wheels_whose_host_is_lost_stop_by_themselves(rolling, world):
    time.sleep(2)
    watch_s = rolling.wheels[LEFT].sdo[0x2000].raw / 1000
    assert watch_s > 0, "the watch over the host is off as delivered"
    rolling.fall_silent()
    time.sleep(watch_s + 2)
    assert max(turning(world)) < 1


def test_an_over_voltage_is_seen_and_recovered_from(rolling, world):
    time.sleep(1)
    world[LEFT].set_supply(85)  # its limit is 75 V
    assert rolling.fault.wait(2), "the base did not see the fault"
    rolling.emergency_stop()
    assert world[LEFT].error_code == 0x0001
    until(lambda: max(turning(world)) < 1, 10)
    world[LEFT].set_supply(48)
    until(lambda: world[LEFT].supply_v < 60, 10)
    time.sleep(0.5)
    rolling.reset()
    rolling.start()
    rolling.drive(0.5)
    time.sleep(2)
    assert turning(world) == pytest.approx([ROLLING_RPM] * 2, rel=0.05)


def test_a_wheel_that_was_replaced_by_another_model_is_refused(world):
    other = ferrodrive.World()
    other.add("zlac8030l", node=LEFT)
    other.add("m4230e17b50", node=RIGHT)
    base = Base(ferrodrive.eds("zlac8030l"), interface="ferrodrive", channel=other)
    try:
        base.wait_until_booted()
        with pytest.raises(Fault, match=f"wheel {RIGHT} is another drive"):
            base.start()
        assert max(turning(other)) == 0
    finally:
        base.close()


def test_a_wheel_that_lost_its_power_is_set_up_anew(rolling, world):
    time.sleep(1)
    world[RIGHT].power_cycle()
    until(lambda: (world[RIGHT].statusword or 0) & 0x6F != 0x27, 10)
    time.sleep(1)
    rolling.wait_until_booted(20)
    rolling.reset()
    rolling.start()
    rolling.drive(0.5)
    time.sleep(2)
    assert turning(world) == pytest.approx([ROLLING_RPM] * 2, rel=0.05)


def listener(base):
    """Another adapter on the bus of the base."""
    bus = base.network.bus
    return {"interface": "ferrodrive", "channel": bus.world, "pace": bus.pace}
