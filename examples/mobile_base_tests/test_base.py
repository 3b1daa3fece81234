"""A mobile base is tested: what it does with its wheels, and what it does when something breaks."""

import math
import time

import can
import ferrodrive
import pytest
from base import LEFT, RIGHT, WHEEL_BASE_M, WHEEL_RADIUS_M, Base, Fault

#: 0.5 m/s with wheels of 84 mm.
ROLLING_RPM = 0.5 / (2 * math.pi * WHEEL_RADIUS_M) * 60


def until(condition, within_s):
    """Waits, in whatever time the test runs in."""
    end = time.monotonic() + within_s
    while not condition():
        assert time.monotonic() < end, f"not so within {within_s} s"
        time.sleep(0.01)


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


def test_odometry_is_where_the_wheels_truly_rolled(rolling, world):
    time.sleep(1)
    rolling.drive(0.4, 0.8)
    time.sleep(3)
    rolling.drive(0)
    until(lambda: max(turning(world)) < 0.5, 5)
    time.sleep(0.1)
    left_m, right_m = (world[wheel].shaft_angle_rad * WHEEL_RADIUS_M for wheel in (LEFT, RIGHT))
    # The heading depends on the two arcs alone, not on the way: (right - left) / base. One count is 0.13 mm.
    assert rolling.heading_rad == pytest.approx((right_m - left_m) / WHEEL_BASE_M, abs=0.005)
    assert rolling.heading_rad > 1
    # The way is at least the chord from where it began.
    assert math.hypot(rolling.x_m, rolling.y_m) <= (left_m + right_m) / 2 + 0.001


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
