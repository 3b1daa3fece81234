"""Set-points and halt in profile position (CiA 402-2, 10; ZLAC8030L manual 4.2, 4.3, 7.2; ZLIM42-C manual 5.3.4)."""

from checks import Common, eventually, near, true

COMMON = Common()
check = COMMON.check
POSITION = 1
ACKNOWLEDGE = 1 << 12
#: 2002h of the ZLAC8030L: in place within 30 counts.
IN_PLACE = 30


def is_at(bench, position):
    close = lambda now: abs(now - position) <= IN_PLACE
    eventually(lambda: bench.read(0x6064), close, f"6064h becomes {position}", timeout_s=10)


@check("a set-point given under halt is acknowledged, and waits for the end of halt")
def under_halt(bench):
    bench.enable(POSITION)
    bench.write(0x6040, 0x010F)
    bench.write(0x607A, 3000)
    bench.write(0x6040, 0x011F)
    bench.status_becomes(ACKNOWLEDGE, ACKNOWLEDGE, "bit 12")
    bench.sleep(0.6)
    near(bench.read(0x6064), 0, IN_PLACE, "6064h under halt")
    bench.write(0x6040, 0x000F)
    is_at(bench, 3000)


@check("an immediate set-point given under halt on the way does not let the motor go on")
def under_halt_on_the_way(bench):
    bench.enable(POSITION)
    bench.write(0x607A, 500_000)
    bench.write(0x6040, 0x001F)
    bench.sleep(0.4)
    bench.write(0x6040, 0x010F)
    bench.write(0x607A, -2000)
    bench.write(0x6040, 0x013F)
    bench.sleep(0.6)
    halted = bench.read(0x6064)
    bench.sleep(0.3)
    near(bench.read(0x6064), halted, IN_PLACE, "6064h under halt")
    true(halted > 0, f"halted at {halted}, before it turned back")
    bench.write(0x6040, 0x000F)
    is_at(bench, -2000)


@check("a target written without a rising edge of bit 4 moves nothing")
def no_edge(bench):
    bench.enable(POSITION)
    for controlword in (0x000F, 0x001F):
        bench.write(0x607A, 1000)
        bench.write(0x6040, controlword)
    is_at(bench, 1000)
    bench.write(0x607A, 9000)
    bench.write(0x6040, 0x001F)
    bench.sleep(0.5)
    near(bench.read(0x6064), 1000, IN_PLACE, "6064h after 1Fh again, without an edge")


@check("set-points outside operation enabled are not kept for later")
def not_enabled(bench):
    bench.write(0x6060, POSITION)
    for controlword in (0x06, 0x07):
        bench.write(0x607A, 5000)
        bench.write(0x6040, controlword | 0x10)
        bench.write(0x6040, controlword)
    bench.write(0x6040, 0x000F)
    bench.sleep(0.5)
    near(bench.read(0x6064), 0, IN_PLACE, "6064h")


@check("switching off on the way drops the move, and enabling again does not go on")
def switched_off(bench):
    bench.enable(POSITION)
    bench.write(0x607A, 500_000)
    bench.write(0x6040, 0x001F)
    bench.sleep(0.4)
    bench.write(0x6040, 0x0000)
    bench.sleep(0.8)
    for controlword in (0x06, 0x07, 0x0F):
        bench.write(0x6040, controlword)
    bench.sleep(0.3)
    stopped = bench.read(0x6064)
    bench.sleep(0.5)
    # A free wheel may still have been rolling.
    near(bench.read(0x6064), stopped, 500, "6064h")
