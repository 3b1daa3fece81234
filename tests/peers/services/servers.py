"""The simulator itself: slcan beside socketcand, several clients on a bus, wrong commands. It is the same for every drive."""

import subprocess

import can

from checks import PATIENCE_S, check, equal, table, true
from drive import ALL, ZLAC8030L, ZLIM42C

SLCAN = ("--serve", "slcan://127.0.0.1:0")


def slcan(bench):
    return can.Bus(interface="slcan", channel=f"socket://127.0.0.1:{bench.simulator.port('slcan')}", bitrate=500_000)


def received(bus, cob_id):
    """The next frame with that identifier."""
    while message := bus.recv(PATIENCE_S):
        if message.arbitration_id == cob_id:
            return message
    raise AssertionError(f"no frame {cob_id:03X}h")


def request(bench, *data):
    return can.Message(arbitration_id=0x600 + bench.node_id, data=data, is_extended_id=False)


@check("python-can over slcan reads and writes, and each client hears the drive and the other clients, and not itself", *ALL, extra=SLCAN)
def clients(bench):
    with slcan(bench) as bus:
        mark = bench.trace.mark()
        bus.send(request(bench, 0x40, 0, 0x10, 0, 0, 0, 0, 0))
        answer = received(bus, 0x580 + bench.node_id)
        equal(bytes(answer.data), b"\x43\x00\x10\x00" + bench.drive.device_type.to_bytes(4, "little"), "1000h")
        heard = bench.trace.wait(0x600 + bench.node_id, mark, "the slcan client's frame at the socketcand client")
        equal(heard.data[0], 0x40, "the frame that was heard")
        bench.trace.wait(0x580 + bench.node_id, mark, "the drive's answer at the socketcand client")
        mark = bench.trace.mark()
        bench.send(0x123, b"\x01\x02")
        equal(bytes(received(bus, 0x123).data), b"\x01\x02", "the socketcand client's frame at the slcan client")
        bus.send(request(bench, 0x23, 0x81, 0x60, 0, 77, 0, 0, 0))
        received(bus, 0x580 + bench.node_id)
        # The same answer must have passed here, or canopen-python takes it for that of its own request.
        written = lambda frame: frame.data[0] == 0x60
        bench.trace.wait(0x580 + bench.node_id, mark, "the answer at the socketcand client", written)
        equal(bench.trace.since(mark, 0x123), [], "its own frame at the socketcand client")
        equal(bench.read(0x6081), 77, "6081h by socketcand after a write by slcan")


@check("node guarding and LSS get no answer: the manuals have neither", *ALL, extra=SLCAN)
def no_such_services(bench):
    bench.write(0x1017, 0)
    mark, guarding = bench.trace.mark(), 0x700 + bench.node_id
    with slcan(bench) as bus:
        bus.send(can.Message(arbitration_id=guarding, is_remote_frame=True, dlc=1, is_extended_id=False))
        for command in (0x04, 0x5E):
            bus.send(can.Message(arbitration_id=0x7E5, data=(command, 1, 0, 0, 0, 0, 0, 0), is_extended_id=False))
        bench.sleep(0.3)
    answers = [frame for frame in bench.trace.since(mark, guarding) if not frame.is_remote_frame]
    equal(answers + bench.trace.since(mark, 0x7E4), [], "answers")


@check("a line that is not a world command is answered by one refusal and changes nothing", ZLAC8030L)
def no_command(bench):
    node = bench.node_id
    lines = ["get", "nonsense", "99 get", f"{node}"]
    lines += [f"{node} {rest}" for rest in ("supply", "supply -3", "supply NaN", "load torque inf", "fault all on", "power sideways")]
    lines += [f"{node} {rest}" for rest in ("input Q9 1", "input X0", "switch Q9 0 1", "get more", "rotor", "temperature motor hot")]
    for line in lines:
        answer = bench.simulator.tell(line)
        true(answer["ok"] is False and answer["error"], f"{line!r} is refused with a reason: {answer}")
    for blank in ("", "   "):
        bench.simulator.process.stdin.write(blank + "\n")
    # Had a blank line been answered, this would be that answer.
    equal(bench.world("get")["node"], node, "the node of `get`")


WRONG = table("what words", ("an unknown model", ["nosuch@1"]), ("node 0", ["zlim42c@0"]), ("node 128", ["zlim42c@128"]), ("a node twice", ["zlac8030l@3", "zlim42c@3"]), ("no node", ["zlim42c"]))


@check("{what} is a usage error before anything listens", ZLIM42C, rows=WRONG)
def bad_drives(bench, row):
    words = [word for drive in row["words"] for word in ("--drive", drive)]
    done = subprocess.run([bench.program, "sim", *words, "--serve", "socketcand://127.0.0.1:0"], capture_output=True, text=True, timeout=PATIENCE_S, input="")
    equal(done.returncode, 2, f"exit status of {words}")
    true(done.stderr.strip() and "ready" not in done.stdout, f"a reason for {words}: {done.stderr!r} {done.stdout!r}")
