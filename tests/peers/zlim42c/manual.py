"""Every datagram that the manual prints, byte by byte, with python-can alone, and the moves that they command."""

import datagrams
from checks import check, equal, eventually, near
from zlim42c import DRIVE
from zlim42c.axis import rotor


@check("manual 5.3.2: the drive answers each datagram, and the statusword ends in 0, 1, 3 and 7 in turn")
def initialise(bench):
    datagrams.replay(bench, "5.3.2")
    for controlword, nibble in ((0x00, 0x0), (0x06, 0x1), (0x07, 0x3), (0x0F, 0x7)):
        bench.ask(bytes((0x2B, 0x40, 0x60, 0, controlword, 0, 0, 0)))
        bench.status_becomes(0xF, nibble, f"the low nibble after {controlword:02X}h")


@check("manual 5.3.4: the datagrams move the motor by 3200 pulses, 0.8 turns")
def position(bench):
    datagrams.replay(bench, "5.3.4")
    bench.status_becomes(1 << 10, 1 << 10, "bit 10 tells that the target is reached")
    equal(bench.read(0x6064), 3200, "6064h")


@check("manual 5.3.5: the datagrams turn the motor at 60 r/min")
def velocity(bench):
    datagrams.replay(bench, "5.3.5")
    eventually(lambda: bench.read(0x606C), lambda speed: speed == 60, "606Ch")
    start = bench.world("get")
    bench.sleep(0.5)
    end = bench.world("get")
    # The mean, since a stepper's rotor rings around its steps.
    near((rotor(end) - rotor(start)) / (end["t"] - start["t"]), 4000, 80, "the rotor's pulses a second")


@check("manual 5.3.6: the datagrams home on the positive limit")
def homing(bench):
    bench.write(0x2030, 2, sub=2)
    bench.world("switch X0 2000 max")
    datagrams.replay(bench, "5.3.6")
    bench.status_becomes(1 << 8, 1 << 8, "bit 8 tells that homing is done", timeout_s=10)
    bench.status_becomes(1 << 14, 0, "bit 14 tells that the motor stands")
    # At 60 r/min, 4000 pulses a second, the edge is seen 10 ms late (3.2), and there the motor stops.
    near(rotor(bench.world("get")), 2000 + 40, 20, "where the rotor stands, from where it started")


# Every section of the data file is replayed above.
assert list(datagrams.sections(DRIVE)) == ["5.3.2", "5.3.4", "5.3.5", "5.3.6"]


@check("manual 5.2: the drive announces itself with 701h and one zero byte, in pre-operational, when it is powered on")
def announces(bench):
    bench.write(0x1017, 50)
    bench.write(0x2010, 2)
    bench.power_cycle()
    mark = bench.trace.mark()
    frame = bench.trace.wait(0x701, mark, 3.0, "a heartbeat")
    equal(bytes(frame.data), b"\x7F", "heartbeat after power-on")
