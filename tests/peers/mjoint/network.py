"""Boot-up, NMT, heartbeat and the watch over the host's heartbeat (manual 5.08.1 and 5.11; CiA 301)."""

import statistics
import time

from checks import check, equal, eventually, near, true
from mjoint.joint import HOST_HEARTBEAT, SPEED, command, rpdo3, speed_becomes
from pdos import gaps

HEARTBEAT = 0x701
START, STOP, PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION = 0x01, 0x02, 0x80, 0x81, 0x82
COMMUNICATION_LOST = 0x20


def heartbeat_is(bench, expected, timeout_s=3.0):
    mark = bench.trace.mark()
    bench.trace.wait(HEARTBEAT, mark, timeout_s, f"heartbeat {expected:02X}", lambda frame: frame.data[0] == expected)


@check("the joint boots into operational: boot-up, then heartbeat 05 each 1000 ms, without any NMT command")
def boots_operational(bench):
    mark = bench.trace.mark()
    bench.world("power cycle")
    bench.sleep(3.4)
    frames = bench.trace.since(mark, HEARTBEAT)
    equal(frames[0].data, b"\x00", "the boot-up")
    equal({bytes(frame.data) for frame in frames[1:]}, {b"\x05"}, "the heartbeats")
    near(statistics.mean(gaps(frames[1:])), 1.0, 0.01, "mean time between heartbeats in s")


@check("1017h sets the time between heartbeats, and 0 switches them off")
def heartbeat_time(bench):
    bench.write(0x1017, 100)
    mark = bench.trace.mark()
    bench.sleep(1.0)
    frames = bench.trace.since(mark, HEARTBEAT)
    near(statistics.mean(gaps(frames)), 0.1, 0.002, "mean time between heartbeats in s")
    bench.write(0x1017, 0)
    time.sleep(0.05)
    mark = bench.trace.mark()
    bench.sleep(1.3)
    equal(len(bench.trace.since(mark, HEARTBEAT)), 0, "heartbeats with 1017h = 0")


@check("NMT commands act: pre-operational, start, stop, both resets")
def commands(bench):
    bench.write(0x1017, 50)
    for nmt, state in ((PRE_OPERATIONAL, 0x7F), (START, 0x05), (STOP, 0x04), (START, 0x05)):
        bench.nmt(nmt)
        time.sleep(0.1)
        heartbeat_is(bench, state)
    for nmt in (RESET_NODE, RESET_COMMUNICATION):
        mark = bench.trace.mark()
        bench.nmt(nmt)
        bench.trace.wait(HEARTBEAT, mark, 5.0, "boot-up", lambda frame: frame.data == b"\0")
        bench.trace.wait(HEARTBEAT, mark, 5.0, "operational again", lambda frame: frame.data == b"\x05")


@check("PDOs rest in pre-operational, and SDO works there")
def pre_operational(bench):
    bench.nmt(PRE_OPERATIONAL)
    time.sleep(0.1)
    mark = bench.trace.mark()
    bench.send(0x301, (1234).to_bytes(4, "little") + (900).to_bytes(4, "little"))
    time.sleep(0.2)
    equal(bench.trace.since(mark, 0x281), [], "TPDO2 in pre-operational")
    equal(bench.read(0x607A), 0, "607Ah after an RPDO2 in pre-operational")
    bench.nmt(START)
    time.sleep(0.1)
    equal(bench.read(0x607A), 0, "607Ah after NMT start")


def host_beats(bench, state=0x05):
    bench.send(HOST_HEARTBEAT, [state])


@check("the host's first heartbeat arms the watch; without the next one within 2 s comes alarm 20h and the motor stops")
def watch(bench):
    command(bench, SPEED, 0x0F)
    bench.write(0x60FF, 300)
    speed_becomes(bench, 300)
    bench.sleep(2.3)
    equal(bench.read(0x260E), 0, "260Eh before any heartbeat of the host")
    mark = bench.trace.mark()
    for _ in range(3):
        host_beats(bench)
        bench.sleep(0.5)
    equal(bench.read(0x260E), 0, "260Eh while the host beats")
    begin = bench.now()
    eventually(lambda: bench.read(0x260E), lambda code: code == COMMUNICATION_LOST, "260Eh after the host's silence", 6)
    near(bench.now() - begin, 1.5, 0.3, "seconds until the alarm: 2 s less the half second that has passed")
    bench.status_becomes(1 << 3, 1 << 3, "bit 3")
    speed_becomes(bench, 0)
    true(not any(frame.data == b"\x04" for frame in bench.trace.since(mark, HEARTBEAT)[:2]), "no heartbeat 04 before the alarm")
    heartbeat_is(bench, 0x04)


@check("alarm 20h clears itself with the host's next heartbeat, and the motor goes on")
def recovers(bench):
    bench.write(0x1016, 0x007F012C, sub=1)
    command(bench, SPEED, 0x0F)
    bench.write(0x60FF, 300)
    host_beats(bench)
    eventually(lambda: bench.read(0x260E), lambda code: code == COMMUNICATION_LOST, "260Eh")
    speed_becomes(bench, 0)
    equal(bench.statusword(), 0x003F, "the statusword in alarm 20h")
    bench.write(0x1017, 50)
    heartbeat_is(bench, 0x04)
    equal(rpdo3(bench, 0x0F, SPEED, 300)[1] & 1 << 3, 1 << 3, "PDO and SDO go on while the heartbeat is 04")
    end = bench.now() + 2
    while bench.now() < end:
        host_beats(bench)
        if abs(bench.read(0x606C) - 3000) < 60:
            break
        time.sleep(0.05)
    equal(bench.read(0x260E), 0, "260Eh after the host's heartbeat")
    near(bench.read(0x606C), 3000, 100, "606Ch goes on")
    heartbeat_is(bench, 0x05)


@check("heartbeats of other nodes and other frames do not feed the watch")
def others(bench):
    bench.write(0x1016, 0x007F01F4, sub=1)
    host_beats(bench)
    end = bench.now() + 1.5
    while bench.now() < end and not bench.read(0x260E):
        bench.send(0x77E, [0x05])
        bench.send(0x080)
    equal(bench.read(0x260E), COMMUNICATION_LOST, "260Eh")


@check("1016h:01 with 0 ms switches the watch off, and another node-ID moves it")
def another_host(bench):
    bench.write(0x1016, 0x007F0000, sub=1)
    host_beats(bench)
    bench.sleep(0.5)
    equal(bench.read(0x260E), 0, "260Eh with 0 ms")
    bench.write(0x1016, 0x000A0190, sub=1)
    host_beats(bench)
    bench.sleep(0.8)
    equal(bench.read(0x260E), 0, "260Eh: node 7Fh is not watched")
    bench.send(0x70A, [0x05])
    eventually(lambda: bench.read(0x260E), lambda code: code == COMMUNICATION_LOST, "260Eh after node 0Ah fell silent")


@check("canopen-python sees the state by its own NMT master")
def by_library(bench):
    bench.write(0x1017, 50)
    time.sleep(0.2)
    equal(bench.node.nmt.wait_for_heartbeat(timeout=3), "OPERATIONAL", "state in canopen-python")
    bench.node.nmt.state = "PRE-OPERATIONAL"
    time.sleep(0.2)
    equal(bench.node.nmt.wait_for_heartbeat(timeout=3), "PRE-OPERATIONAL", "state in canopen-python")


@check("nothing but boot-up and heartbeats is sent unasked, not even when an alarm comes")
def no_emergency(bench):
    mark = bench.trace.mark()
    bench.world("supply 55")
    eventually(lambda: bench.read(0x260E), lambda code: code == 0x15, "260Eh")
    bench.sleep(0.5)
    with bench.trace.arrived:
        identifiers = {message.arbitration_id for message in bench.trace.messages[mark:]}
    equal(identifiers - {HEARTBEAT, 0x581}, set(), "identifiers beside heartbeat and SDO")
