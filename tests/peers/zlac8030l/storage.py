"""What survives a power cycle (manual 5, 6 and 2009h, 2010h in chapter 9)."""

import time

from checks import check, equal, eventually, near

SAVE, FACTORY = 2, 1
BOOT_UP = 0x704


def power_cycle(bench):
    mark = bench.trace.mark()
    bench.world("power cycle")
    bench.trace.wait(BOOT_UP, mark, 5.0, "boot-up after the power cycle", lambda frame: frame.data == b"\0")
    time.sleep(0.05)


def save(bench):
    bench.write(0x2009, SAVE)
    # 2009h reads 0 when the store is done; a real EEPROM takes its time.
    eventually(lambda: bench.read(0x2009), lambda value: value == 0, "2009h reads 0 again")
    time.sleep(0.3)


@check("2009h = 2 stores what was written, and the rest is lost with the power")
def save_all(bench):
    bench.write(0x2010, 1)
    bench.write(0x200A, 500)
    save(bench)
    bench.write(0x200A, 600)
    bench.write(0x6081, 333)
    power_cycle(bench)
    equal(bench.read(0x200A), 500, "200Ah, stored")
    equal(bench.read(0x6081), 120, "6081h, which is not stored")
    equal(bench.read(0x2010), 0, "2010h, which is not stored")


@check("with 2010h = 0 each write of a stored object is stored at once")
def save_each(bench):
    bench.write(0x2008, 7)
    time.sleep(1.5)
    power_cycle(bench)
    equal(bench.read(0x2008), 7, "2008h")


@check("2009h = 1 brings the factory settings back")
def factory(bench):
    bench.write(0x200A, 500)
    save(bench)
    bench.write(0x2009, FACTORY)
    time.sleep(1.5)
    power_cycle(bench)
    equal(bench.read(0x200A), 1000, "200Ah")


@check("a PDO mapping that was stored works after a power cycle")
def mapping(bench):
    bench.write(0x1A00, 0, sub=0)
    bench.write(0x1A00, 0x606C0020, sub=1)
    bench.write(0x1800, 1, sub=2)
    bench.write(0x1A00, 1, sub=0)
    save(bench)
    power_cycle(bench)
    equal(bench.read(0x1A00, 0), 1, "1A00h:00")
    equal(bench.read(0x1A00, 1), 0x606C0020, "1A00h:01")
    bench.nmt(0x01)
    time.sleep(0.1)
    mark = bench.trace.mark()
    bench.network.sync.transmit()
    equal(bench.trace.wait(0x184, mark, 1.0, "a PDO after SYNC").dlc, 4, "bytes of the PDO")


@check("a speed resolution of 10 acts after a restart: 1000 is 100 r/min")
def resolution(bench):
    bench.write(0x202F, 10, sub=5)
    save(bench)
    power_cycle(bench)
    bench.enable(3)
    bench.write(0x60FF, 1000)
    eventually(lambda: bench.read(0x606C), lambda speed: speed > 950, "606Ch", 3)
    time.sleep(0.3)
    near(bench.read(0x606C), 1000, 50, "606Ch in 0.1 r/min")
