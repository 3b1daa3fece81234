"""NMT states, boot-up and heartbeat (CiA 301, 7.2.8; ZLAC8030L manual 3.2, 3.4, 6.1; ZLIM42-C manual 5.2)."""

import statistics
import time

from checks import Common, equal, near, true
from pdos import gaps

COMMON = Common()
check = COMMON.check
START, STOP, PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION = 0x01, 0x02, 0x80, 0x81, 0x82


def heartbeats(bench):
    return 0x700 + bench.node_id


def state_shown(bench, expected):
    mark = bench.trace.mark()
    shows = lambda frame: frame.data[0] == expected
    bench.trace.wait(heartbeats(bench), mark, 3.0, f"heartbeat {expected:02X}", shows)


@check("reset node is answered by one boot-up of one zero byte")
def reset_node(bench):
    mark = bench.trace.mark()
    bench.nmt(RESET_NODE)
    frame = bench.trace.wait(heartbeats(bench), mark, 5.0, "boot-up")
    equal(bytes(frame.data), b"\x00", "boot-up")
    time.sleep(0.5)
    equal(len(bench.trace.since(mark, heartbeats(bench))), 1, "boot-ups, with the heartbeat off by default")
    equal(bench.read(0x1000), bench.drive.device_type, "1000h after the reset")


@check("reset communication is answered by a boot-up too")
def reset_communication(bench):
    mark = bench.trace.mark()
    bench.nmt(RESET_COMMUNICATION)
    equal(bytes(bench.trace.wait(heartbeats(bench), mark, 5.0, "boot-up").data), b"\x00", "boot-up")


@check("the heartbeat shows pre-operational, operational and stopped in turn")
def states(bench):
    bench.write(0x1017, 50)
    for command, state in ((PRE_OPERATIONAL, 0x7F), (START, 0x05), (STOP, 0x04), (PRE_OPERATIONAL, 0x7F)):
        bench.nmt(command)
        time.sleep(0.1)
        state_shown(bench, state)


@check("a broadcast starts the drive as its own address does, and another address does not")
def broadcast(bench):
    bench.write(0x1017, 50)
    bench.nmt(START, node=bench.node_id + 1)
    time.sleep(0.1)
    state_shown(bench, 0x7F)
    bench.nmt(START, node=0)
    time.sleep(0.1)
    state_shown(bench, 0x05)


@check("no SDO answer in the stopped state, and answers again after it")
def stopped(bench):
    bench.nmt(STOP)
    time.sleep(0.1)
    mark = bench.trace.mark()
    bench.send(0x600 + bench.node_id, bytes.fromhex("40 00 10 00 00 00 00 00"))
    time.sleep(0.3)
    equal(len(bench.trace.since(mark, 0x580 + bench.node_id)), 0, "SDO answers in stopped")
    bench.nmt(PRE_OPERATIONAL)
    time.sleep(0.1)
    equal(bench.read(0x1000), bench.drive.device_type, "1000h in pre-operational")


@check("a heartbeat of 100 ms comes ten times a second")
def heartbeat(bench):
    bench.write(0x1017, 100)
    mark = bench.trace.mark()
    bench.sleep(2.05)
    frames = bench.trace.since(mark, heartbeats(bench))
    true(19 <= len(frames) <= 23, f"20 to 22 heartbeats in 2.05 s, got {len(frames)}")
    near(statistics.mean(gaps(frames)), 0.100, 0.002, "mean time between heartbeats in s")


@check("canopen-python sees the boot-up and the state by its own NMT master")
def by_library(bench):
    bench.write(0x1017, 50)
    bench.node.nmt.state = "OPERATIONAL"
    time.sleep(0.2)
    equal(bench.node.nmt.wait_for_heartbeat(timeout=3), "OPERATIONAL", "state in canopen-python")
