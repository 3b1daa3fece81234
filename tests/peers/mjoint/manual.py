"""Every datagram that the manual prints, byte by byte, with python-can alone, and the moves that they command."""

import datagrams
from checks import check, equal, eventually, near
from mjoint import DRIVE, rows
from mjoint.joint import CLOSE, SPEED, is_at, rpdo3, speed_becomes


@check("manual 5.06.1: the datagrams go to the absolute position 50000, and the statusword ends with 0437h")
def absolute(bench):
    datagrams.replay(bench, "5.06.1", patience_s=15)
    is_at(bench, 50000)


@check("manual 5.06.2: the datagrams go 50000 counts further, and the statusword ends with 0437h")
def relative(bench):
    start = bench.read(0x6064)
    datagrams.replay(bench, "5.06.2", patience_s=15)
    is_at(bench, start + 50000)
    equal(bench.read(0x6040), 0x4F, "6040h: bit 4 has cleared itself")


@check("manual 5.07.1: the datagrams run at 500 r/min and halt, with 0437h both times")
def speed(bench):
    datagrams.replay(bench, "5.07.1", patience_s=15)
    speed_becomes(bench, 0)
    bench.write(0x6040, 0x000F)
    speed_becomes(bench, 500)


@check("manual 5.09: the datagrams home on DIR, and the statusword goes from 0014h to 1414h")
def homing(bench):
    bench.world(f"switch DIR min {bench.read(0x6064) - 15000}")
    datagrams.replay(bench, "5.09", patience_s=15)
    near(bench.read(0x6064), 0, 3000, "6064h near the origin")


@check("manual 5.10.1: the datagrams of RPDO1 and RPDO2 go to 50000 and back to 10000")
def position_by_pdo(bench):
    datagrams.replay(bench, "5.10.1", patience_s=15)
    near(bench.read(0x6064), 10000, CLOSE, "6064h")


@check("manual 5.10.2: the datagrams of RPDO3 run at 600 r/min and at -600, and TPDO3 tells the speed in r/min")
def speed_by_pdo(bench):
    datagrams.replay(bench, "5.10.2", patience_s=15)
    settled = lambda answer: abs(answer[0] + 600) <= 6
    speed, statusword = eventually(lambda: rpdo3(bench, 0x0F, SPEED, -600), settled, "speed and statusword in TPDO3")
    equal(statusword, 0x0437, f"statusword in TPDO3 at {speed} r/min")


@check("manual 5.10.3: the datagrams of RPDO4 wait for SYNC on three joints", drives=("m4230e17b50@1", "m4230e17b50@2", "m4230e17b50@3"))
def interpolation(bench):
    joints = [bench, bench.other(2), bench.other(3)]
    for joint in joints:
        joint.write(0x6060, 1)
        joint.write(0x6040, 0x0F)
    before = [joint.read(0x6064) for joint in joints]
    requests = [row for row in rows("datagrams.csv") if row["section"] == "5.10.3"]
    for row in requests[:-1]:
        mark = bench.trace.mark()
        bench.send(int(row["request_cob"], 16), bytes.fromhex(row["request"]))
        answer = bench.trace.wait(int(row["response_cob"], 16), mark, 3.0, row["meaning"])
        got = bytes(answer.data).hex(" ").upper()
        equal(datagrams.masked(got, row["answer"]), row["answer"], row["meaning"])
    bench.sleep(0.3)
    for joint, position in zip(joints, before):
        near(joint.read(0x6064), position, CLOSE, f"6064h of joint {joint.node_id} before SYNC")
    bench.send(int(requests[-1]["request_cob"], 16))
    for joint in joints:
        is_at(joint, 50000, f"6064h of joint {joint.node_id}")


# Every section of the data file with a request is replayed above; the lone SYNC of 5.08.4 is the last one of 5.10.3.
assert [section for section in datagrams.sections(DRIVE)] == ["5.06.1", "5.06.2", "5.07.1", "5.09", "5.10.1", "5.10.2", "5.10.3"]
