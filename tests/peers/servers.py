"""The simulator itself, for any drive: slcan beside socketcand, several clients on a bus, wrong commands."""

import subprocess

import can

from checks import Common, equal, true

COMMON = Common()
check = COMMON.check
SLCAN = ("--serve", "slcan://127.0.0.1:0")


def received(bus, cob_id, timeout_s=3.0):
    """The next frame with that identifier."""
    while message := bus.recv(timeout_s):
        if message.arbitration_id == cob_id:
            return message
    raise AssertionError(f"no frame {cob_id:03X}h within {timeout_s} s")


def request(bench, *data):
    return can.Message(arbitration_id=0x600 + bench.node_id, data=data, is_extended_id=False)


@check("python-can over slcan reads and writes objects", extra=SLCAN)
def slcan(bench):
    channel = f"socket://127.0.0.1:{bench.simulator.port('slcan')}"
    with can.Bus(interface="slcan", channel=channel, bitrate=500_000) as bus:
        bus.send(request(bench, 0x40, 0, 0x10, 0, 0, 0, 0, 0))
        answer = received(bus, 0x580 + bench.node_id)
        equal(bytes(answer.data), b"\x43\x00\x10\x00" + bench.drive.device_type.to_bytes(4, "little"), "1000h")
        mark = bench.trace.mark()
        bus.send(request(bench, 0x23, 0x81, 0x60, 0, 77, 0, 0, 0))
        received(bus, 0x580 + bench.node_id)
        # The same answer must have passed here, or canopen-python takes it for that of its own request.
        written = lambda frame: frame.data[0] == 0x60
        bench.trace.wait(0x580 + bench.node_id, mark, 3.0, "the answer at the socketcand client", written)
        equal(bench.read(0x6081), 77, "6081h by socketcand after a write by slcan")


@check("each client hears the drive and the other clients, and not itself", extra=SLCAN)
def all_hear_all(bench):
    channel = f"socket://127.0.0.1:{bench.simulator.port('slcan')}"
    with can.Bus(interface="slcan", channel=channel, bitrate=500_000) as bus:
        mark = bench.trace.mark()
        bus.send(request(bench, 0x40, 0, 0x10, 0, 0, 0, 0, 0))
        received(bus, 0x580 + bench.node_id)
        heard = bench.trace.wait(0x600 + bench.node_id, mark, 3.0, "the slcan client's frame at the socketcand client")
        equal(heard.data[0], 0x40, "the frame that was heard")
        bench.trace.wait(0x580 + bench.node_id, mark, 3.0, "the drive's answer at the socketcand client")
        mark = bench.trace.mark()
        bench.send(0x123, b"\x01\x02")
        equal(bytes(received(bus, 0x123).data), b"\x01\x02", "the socketcand client's frame at the slcan client")
        equal(bench.trace.since(mark, 0x123), [], "its own frame at the socketcand client")


@check("node guarding and LSS get no answer: the manual has neither", extra=SLCAN)
def no_such_services(bench):
    bench.write(0x1017, 0)
    mark = bench.trace.mark()
    channel = f"socket://127.0.0.1:{bench.simulator.port('slcan')}"
    with can.Bus(interface="slcan", channel=channel, bitrate=500_000) as bus:
        bus.send(can.Message(arbitration_id=0x700 + bench.node_id, is_remote_frame=True, dlc=1, is_extended_id=False))
        bus.send(can.Message(arbitration_id=0x7E5, data=(0x04, 1, 0, 0, 0, 0, 0, 0), is_extended_id=False))
        bus.send(can.Message(arbitration_id=0x7E5, data=(0x5E, 0, 0, 0, 0, 0, 0, 0), is_extended_id=False))
        bench.sleep(0.3)
        equal([frame for frame in bench.trace.since(mark, 0x700 + bench.node_id) if not frame.is_remote_frame], [], "guarding answers")
        equal(bench.trace.since(mark, 0x7E4), [], "LSS answers")
    equal(bench.read(0x1000), bench.drive.device_type, "1000h")


@check("a line that is no world command is answered by one refusal and changes nothing")
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


@check("drives that cannot be are a usage error before anything listens")
def bad_drives(bench):
    program = bench.program
    for drives in (["nosuch@1"], [f"{bench.drive.model}@0"], [f"{bench.drive.model}@128"], [f"{bench.drive.model}@3", "zlim42c@3"], [bench.drive.model]):
        words = [word for drive in drives for word in ("--drive", drive)]
        done = subprocess.run([program, "sim", *words, "--serve", "socketcand://127.0.0.1:0"], capture_output=True, text=True, timeout=20, input="")
        equal(done.returncode, 2, f"exit status of {words}")
        true(done.stderr.strip() and "ready" not in done.stdout, f"a reason for {words}: {done.stderr!r} {done.stdout!r}")
