"""Node-IDs and bit rates: switches, objects, and when they take effect (ZLIM42-C, 4.1 and 5.4; joint, 5.08.2)."""

from checks import check, equal, eventually, table, true
from drive import MJOINT, ZLIM42C

#: The communication objects that hold the node-ID, and what it is added to.
COB_IDS = {(0x1400, 1): 0x200, (0x1403, 1): 0x500, (0x1800, 1): 0x180, (0x1803, 1): 0x480}
#: 2009h of the ZLIM42-C.
RATES = {0: 1_000_000, 2: 250_000, 4: 100_000, 6: 25_000}
#: Up to 15 the switches decide, from 32 on 2008h does.
NODES = [{"node": node, "drives": (f"zlim42c@{node}",)} for node in (1, 7, 15, 32, 100, 127)]
MOVES = {
    "zlim42c": table("object value was becomes drives", (0x2008, 90, 40, 90, ("zlim42c@40",)), (0x2008, 20, 40, 1, ("zlim42c@40",))),
    "mjoint": table("object value was becomes", (0x2615, 5, 1, 5)),
}


def has_identifiers_of(remote, node):
    for (index, sub), base in COB_IDS.items():
        equal(remote.read(index, sub), base + node, f"{index:04X}h:{sub:02X}")


def power_cycle(bench, boots_as):
    mark = bench.trace.mark()
    bench.world("power cycle")
    bench.trace.wait(0x700 + boots_as, mark, f"boot-up of node {boots_as}", lambda frame: frame.data == b"\0")


@check("node {node}: the drive is there, with the identifiers of that node, and the switches go before 2008h", ZLIM42C, rows=NODES)
def node(bench, row):
    equal(bench.read(0x2000), row["node"], "2000h")
    has_identifiers_of(bench, row["node"])
    if row["node"] <= 15:
        bench.write(0x2008, 50)
        bench.sleep(0.5)
        power_cycle(bench, boots_as=row["node"])


@check("{object:04X}h = {value} makes node {was} node {becomes} from the next power-on", ZLIM42C, MJOINT, rows=lambda drive: MOVES[drive.name])
def moved(bench, row):
    bench.write(row["object"], row["value"])
    bench.save()
    equal(bench.read(0x1000), bench.drive.device_type, "1000h of the old node")
    power_cycle(bench, boots_as=row["becomes"])
    has_identifiers_of(bench.other(row["becomes"]), row["becomes"])
    # The world knows the drive by the number of the command line, and says the present one.
    equal(bench.world("get")["node"], row["becomes"], "the node of `get`")
    true(not bench.answers(), "no answer from the old number")


@check("the bit rate of 2009h = {setting} holds from the next power-on, and a rate that is not the bus's is off the bus", ZLIM42C, rows=[{"setting": n} for n in RATES])
def bit_rate(bench, row):
    bench.write(0x2009, row["setting"])
    bench.sleep(0.5)
    equal(bench.read(0x1000), bench.drive.device_type, "1000h at the present rate, which holds until the power cycle")
    mark = bench.trace.mark()
    bench.world("power cycle")
    # It drains, and boots for a second or so.
    eventually(lambda: bench.world("get")["power"], lambda power: power == "on", "it has booted")
    equal(bench.world("get")["bitrate"], RATES[row["setting"]], "the drive's rate")
    equal(bench.trace.since(mark, 0x701), [], "boot-ups that got through")
    true(not bench.answers(), "an answer at another rate")


@check("a bit rate that was saved lasts over runs: the drive is found on a bus of its rate", ZLIM42C, state=True)
def rate_over_runs(bench):
    bench.write(0x2009, 2)
    bench.sleep(2.5)
    bench.extra += ["--bitrate", "250k"]
    bench.restart()
    equal((bench.read(0x2009), bench.world("get")["bitrate"]), (2, 250_000), "2009h, and the drive's rate")


@check("four drives share a bus, each by its own address", ZLIM42C, drives=("zlim42c@1", "zlim42c-82@2", "zlim42c@3", "zlim42c@77"))
def together(bench):
    others = [bench.other(node) for node in (2, 3, 77)]
    for other in others:
        eventually(lambda: other.answers(10.0), bool, f"node {other.node_id} answers")
        other.write(0x6081, 100 + other.node_id)
    equal([remote.read(0x6081) for remote in (bench, *others)], [120, 102, 103, 177], "6081h of each")
