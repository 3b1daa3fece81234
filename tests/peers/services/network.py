"""NMT, boot-up, heartbeat and who watches whom (CiA 301, 7.2.8; the joint's manual, 5.08.1 and 5.11)."""

import statistics

from checks import PATIENCE_S, check, equal, eventually, near, true
from drive import ALL, MJOINT

START, STOP, PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION = 0x01, 0x02, 0x80, 0x81, 0x82
COMMUNICATION_LOST = 0x20


def heartbeat_becomes(bench, state, mark=None):
    mark = bench.trace.mark() if mark is None else mark
    shows = lambda frame: bytes(frame.data) == bytes([state])
    return bench.trace.wait(0x700 + bench.node_id, mark, f"heartbeat {state:02X}", shows)


def gaps(frames):
    """The times between frames, in seconds of the simulator."""
    times = [frame.timestamp for frame in frames]
    return [later - earlier for earlier, later in zip(times, times[1:])]


def answered_at(bench):
    """When the drive answered a read, in seconds of the simulator."""
    mark = bench.trace.mark()
    bench.read(0x1000)
    return bench.trace.wait(0x580 + bench.node_id, mark, "the answer").timestamp


def within(bench, mark, duration_s):
    """Boot-up and heartbeats after the mark, of so many seconds of the simulator from the first on."""
    bench.read(0x1000)  # what was sent before the answer has been heard by then
    frames = bench.trace.since(mark, 0x700 + bench.node_id)
    return [frame for frame in frames if frame.timestamp - frames[0].timestamp < duration_s]


@check("the heartbeat shows what NMT commands do, to its node and to all, and that those to others do nothing", *ALL)
def states(bench):
    bench.write(0x1017, 50)
    for command, node, state in (
        (PRE_OPERATIONAL, None, 0x7F), (START, bench.node_id + 1, 0x7F), (START, None, 0x05), (STOP, None, 0x04),
        (PRE_OPERATIONAL, 0, 0x7F), (START, 0, 0x05),
    ):
        bench.nmt(command, node)
        bench.sleep(0.1)
        heartbeat_becomes(bench, state)


@check("both resets are answered by one boot-up, and the node is then in the state that it boots into", *ALL)
def resets(bench):
    for command in (RESET_NODE, RESET_COMMUNICATION):
        mark = bench.trace.mark()
        bench.nmt(command)
        heartbeat_becomes(bench, 0x00, mark)
        bench.sleep(0.3)
        bench.read(0x1000)  # what was sent before the answer has been heard by then
        boots = [frame for frame in bench.trace.since(mark, 0x700 + bench.node_id) if frame.data == b"\0"]
        equal(len(boots), 1, "boot-ups")
        bench.write(0x1017, 50)
        heartbeat_becomes(bench, bench.drive.boots_as)
        bench.write(0x1017, 0)


@check("it announces itself when it is powered on, and only the joint then sends heartbeats unasked", *ALL)
def power_on(bench):
    bench.write(0x1017, 0)  # no heartbeat of before, and not saved
    mark = bench.trace.mark()
    bench.power_cycle()
    bench.sleep(2.5)
    states = [bytes(frame.data) for frame in within(bench, mark, 2.5)]
    equal(states, [b"\0"] + ([b"\x05"] * 2 if bench.drive is MJOINT else []), "boot-up and heartbeats")


@check("no SDO answer in the stopped state, and answers again after it", *ALL)
def stopped(bench):
    bench.nmt(STOP)
    bench.sleep(0.1)
    true(not bench.answers(), "no SDO answers in stopped")
    bench.nmt(PRE_OPERATIONAL)
    bench.sleep(0.1)
    equal(bench.read(0x1000), bench.drive.device_type, "1000h in pre-operational")


@check("a heartbeat of 100 ms comes ten times a second, and one of 0 ms never", *ALL)
def heartbeat(bench):
    bench.write(0x1017, 100)
    mark = bench.trace.mark()
    bench.sleep(2.05)
    frames = within(bench, mark, 2.05)
    true(20 <= len(frames) <= 22, f"20 to 22 heartbeats in 2.05 s, got {len(frames)}")
    near(statistics.mean(gaps(frames)), 0.100, 0.002, "mean time between heartbeats in s")
    bench.write(0x1017, 0)
    bench.sleep(0.05)
    mark = bench.trace.mark()
    bench.sleep(1.3)
    equal(bench.trace.since(mark, 0x700 + bench.node_id), [], "heartbeats with 1017h = 0")


@check("canopen-python commands and sees the state by its own NMT master", *ALL)
def by_library(bench):
    bench.write(0x1017, 50)
    for state in ("OPERATIONAL", "PRE-OPERATIONAL"):
        bench.node.nmt.state = state
        shown = lambda: bench.node.nmt.wait_for_heartbeat(timeout=PATIENCE_S)
        eventually(shown, lambda now: now == state, "state in canopen-python")


@check("the host's first heartbeat arms the watch of 1016h; its silence is alarm 20h, and its next one ends that", MJOINT)
def host_watch(bench):
    bench.turn(300)
    bench.sleep(2.3)
    equal(bench.read(0x260E), 0, "260Eh before any heartbeat of the host")
    bench.write(0x1017, 50)
    for number, identifier in ((0x007F_012C, 0x77F), (0x000A_012C, 0x70A)):
        bench.write(0x1016, number, sub=1)
        # The simulator's clock judges, by frames before and behind the host's heartbeat.
        mark = bench.trace.mark()
        before = answered_at(bench)
        bench.send(identifier, [0x05])
        after = answered_at(bench)
        alarm = lambda frame: frame.data == b"\x04" and frame.timestamp > after
        at = bench.trace.wait(0x700 + bench.node_id, mark, "a heartbeat in alarm", alarm).timestamp
        true(before + 0.3 <= at <= after + 0.5, f"alarm at {at}, heartbeat of the host from {before} to {after}, 300 ms")
        bench.becomes(0x260E, COMMUNICATION_LOST)
        bench.speed_becomes(0)
        bench.send(0x77E, [0x05])
        equal(bench.statusword(), 0x003F, "the statusword in alarm 20h, and another node's heartbeat does not end it")
        # Another with each look: a busy machine may look only after the watch has ended again.
        look = lambda: (bench.send(identifier, [0x05]), bench.read(0x260E))[1]
        eventually(look, lambda code: code == 0, "260Eh after the host's heartbeat")


@check("nothing but boot-up and heartbeats is sent unasked, not even when an alarm comes", MJOINT)
def no_emergency(bench):
    mark = bench.trace.mark()
    bench.world("supply 55")
    bench.becomes(0x260E, 0x15)
    bench.sleep(0.5)
    with bench.trace.arrived:
        identifiers = {message.arbitration_id for message in bench.trace.messages[mark:]}
    equal(identifiers - {0x701, 0x581}, set(), "identifiers beside heartbeat and SDO")
