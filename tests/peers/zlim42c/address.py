"""Node-IDs of the address switches and of 2008h, and bit rates of 2009h (manual 4.1 and 5.4)."""

import time

from checks import check, equal, eventually, true


def reset_power(bench, boots_as):
    """A power cycle after which the boot-up comes from that node-ID."""
    mark = bench.trace.mark()
    bench.world("power cycle")
    bench.trace.wait(0x700 + boots_as, mark, 8.0, f"boot-up of node {boots_as}", lambda frame: frame.data == b"\0")


def cob_ids(bench):
    """The identifiers that follow the node-ID."""
    return [bench.read(0x1014)] + [bench.read(0x1200, sub) for sub in (1, 2)] + [bench.read(index, 1) for index in (0x1400, 0x1403, 0x1800, 0x1803)]


def expected_cob_ids(node):
    return [base + node for base in (0x80, 0x600, 0x580, 0x200, 0x500, 0x180, 0x480)]


for _node in (1, 7, 15):

    @check(f"the switches set to {_node} make node {_node}, whatever 2008h says", drives=(f"zlim42c@{_node}",))
    def by_switches(bench):
        equal(bench.read(0x2000), bench.node_id, "2000h")
        equal(cob_ids(bench), expected_cob_ids(bench.node_id), "the identifiers")
        bench.write(0x2008, 50)
        bench.sleep(0.5)
        reset_power(bench, boots_as=bench.node_id)
        equal(bench.read(0x2000), bench.node_id, "2000h after the power cycle")


for _node in (32, 100, 127):

    @check(f"with the switches at 0, 2008h = {_node} makes node {_node}", drives=(f"zlim42c@{_node}",))
    def by_object(bench):
        equal(bench.read(0x2008), bench.node_id, "2008h")
        equal(bench.read(0x2000), bench.node_id, "2000h")
        equal(cob_ids(bench), expected_cob_ids(bench.node_id), "the identifiers")


@check("a new node number of 2008h holds from the next power-on, for every identifier", drives=("zlim42c@40",))
def renumbered(bench):
    bench.write(0x2008, 90)
    bench.sleep(0.5)
    equal(bench.read(0x2000), 40, "2000h before the power cycle")
    reset_power(bench, boots_as=90)
    moved = bench.other(90)
    equal(moved.read(0x2000), 90, "2000h")
    equal(cob_ids(moved), expected_cob_ids(90), "the identifiers")
    # The world knows the drive by the number of the command line, and says the present one.
    equal(bench.world("get")["node"], 90, "the node of `get`")
    true(not bench.answers(), "no answer from the old number")


@check("a node number of 2008h under 32 is undefined: node 1 here", drives=("zlim42c@40",))
def undefined(bench):
    bench.write(0x2008, 20)
    bench.sleep(0.5)
    reset_power(bench, boots_as=1)
    equal(bench.other(1).read(0x2000), 1, "2000h")


RATES = {0: 1_000_000, 1: 500_000, 2: 250_000, 3: 125_000, 4: 100_000, 5: 50_000, 6: 25_000}


@check("each bit rate of 2009h holds from the next power-on, and another one than the bus's is off the bus")
def bit_rates(bench):
    for setting in (6, 5, 4, 3, 2, 0):
        bench.write(0x2009, setting)
        bench.sleep(0.5)
        true(bench.answers(), "the present rate holds until the power cycle")
        mark = bench.trace.mark()
        bench.world("power cycle")
        bench.sleep(0.5)
        equal(bench.world("get")["bitrate"], RATES[setting], f"the drive's rate with 2009h = {setting}")
        equal(bench.trace.since(mark, 0x701), [], "boot-ups that got through")
        true(not bench.answers(), "an answer at another rate")
        # The drive cannot be reached at its rate here, so begin anew.
        bench.restart()


@check("on a bus of 250 kbit/s the drive is there, and 2009h = 1 takes it away", extra=("--bitrate", "250k"))
def other_bus(bench):
    equal(bench.world("get")["bitrate"], 250_000, "the drive's rate")
    bench.write(0x2009, 1)
    bench.sleep(0.5)
    bench.world("power cycle")
    bench.sleep(0.5)
    true(not bench.answers(), "an answer at another rate")


@check("the ZLAC8030L's save command 2B 09 20 00 02 sets 250 kbit/s here, and the drive is gone after a power cycle")
def trap(bench):
    equal(bench.ask(bytes.fromhex("2B 09 20 00 02 00 00 00")), bytes.fromhex("60 09 20 00 00 00 00 00"), "the answer")
    equal(bench.read(0x2009), 2, "2009h: 2 is 250 kbit/s")
    bench.sleep(0.5)
    mark = bench.trace.mark()
    bench.world("power cycle")
    bench.sleep(1.0)
    equal(bench.world("get")["bitrate"], 250_000, "the drive's rate")
    equal(bench.trace.since(mark, 0x701), [], "boot-ups that got through")
    true(not bench.answers(), "an answer at another rate")


@check("a bit rate that was saved lasts over runs: the drive is found on a bus of its rate", state=True)
def rate_over_runs(bench):
    bench.write(0x2009, 2)
    time.sleep(2.5)
    bench.extra += ["--bitrate", "250k"]
    bench.restart()
    equal(bench.read(0x2009), 2, "2009h")
    equal(bench.world("get")["bitrate"], 250_000, "the drive's rate")


@check("three steppers at switch addresses and a custom one share a bus", drives=("zlim42c@1", "zlim42c-82@2", "zlim42c@3", "zlim42c@77"))
def together(bench):
    for node in (2, 3, 77):
        other = bench.other(node)
        eventually(other.answers, bool, f"node {node} answers", 10)
        other.write(0x6081, 100 + node)
    equal([bench.read(0x6081)] + [bench.others[node].read(0x6081) for node in (2, 3, 77)], [120, 102, 103, 177], "6081h of each")
