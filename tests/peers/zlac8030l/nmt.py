"""NMT states, boot-up and heartbeat (manual 3.2, 3.4, 6.1; CiA 301, 7.2.8)."""

import statistics
import time

from checks import check, equal, near, true

START, STOP, PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION = 0x01, 0x02, 0x80, 0x81, 0x82
HEARTBEAT = 0x704


def state_shown(bench, expected):
    mark = bench.trace.mark()
    bench.trace.wait(HEARTBEAT, mark, 1.0, f"heartbeat {expected:02X}", lambda frame: frame.data[0] == expected)


@check("reset node is answered by one boot-up of one zero byte")
def reset_node(bench):
    mark = bench.trace.mark()
    bench.nmt(RESET_NODE)
    frame = bench.trace.wait(HEARTBEAT, mark, 3.0, "boot-up")
    equal(bytes(frame.data), b"\x00", "boot-up")
    time.sleep(0.5)
    equal(len(bench.trace.since(mark, HEARTBEAT)), 1, "boot-ups, with the heartbeat off by default")
    equal(bench.read(0x1000), 0x00040192, "1000h after the reset")


@check("reset communication is answered by a boot-up too")
def reset_communication(bench):
    mark = bench.trace.mark()
    bench.nmt(RESET_COMMUNICATION)
    equal(bytes(bench.trace.wait(HEARTBEAT, mark, 3.0, "boot-up").data), b"\x00", "boot-up")


@check("the heartbeat shows pre-operational, operational and stopped in turn")
def states(bench):
    bench.write(0x1017, 50)
    for command, state in ((PRE_OPERATIONAL, 0x7F), (START, 0x05), (STOP, 0x04), (PRE_OPERATIONAL, 0x7F)):
        bench.nmt(command)
        time.sleep(0.1)
        state_shown(bench, state)


@check("a broadcast starts the drive as its own address does")
def broadcast(bench):
    bench.write(0x1017, 50)
    bench.nmt(START, node=0)
    time.sleep(0.1)
    state_shown(bench, 0x05)


@check("no SDO answer in the stopped state, and answers again after it")
def stopped(bench):
    bench.nmt(STOP)
    time.sleep(0.1)
    mark = bench.trace.mark()
    bench.send(0x604, bytes.fromhex("40 00 10 00 00 00 00 00"))
    time.sleep(0.3)
    equal(len(bench.trace.since(mark, 0x584)), 0, "SDO answers in stopped")
    bench.nmt(PRE_OPERATIONAL)
    time.sleep(0.1)
    equal(bench.read(0x1000), 0x00040192, "1000h in pre-operational")


@check("a heartbeat of 100 ms comes ten times a second")
def heartbeat(bench):
    bench.write(0x1017, 100)
    mark = bench.trace.mark()
    time.sleep(2.1)
    times = [frame.timestamp for frame in bench.trace.since(mark, HEARTBEAT)]
    true(20 <= len(times) <= 22, f"20 to 22 heartbeats in 2.1 s, got {len(times)}")
    gaps = [later - earlier for earlier, later in zip(times, times[1:])]
    near(statistics.mean(gaps), 0.100, 0.002, "mean time between heartbeats in s")


@check("canopen-python sees the boot-up and the state by its own NMT master")
def by_library(bench):
    bench.write(0x1017, 50)
    bench.node.nmt.state = "OPERATIONAL"
    time.sleep(0.2)
    equal(bench.node.nmt.wait_for_heartbeat(timeout=1), "OPERATIONAL", "state in canopen-python")
