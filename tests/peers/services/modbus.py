"""The joint's Modbus addresses with pymodbus: Modbus TCP, and RTU over a pair of pseudo terminals (5.04)."""

import contextlib
import os
import threading

from pymodbus.client import ModbusSerialClient, ModbusTcpClient

from checks import Skip, check, equal, eventually, near, table, true
from drive import MJOINT

SERVED = ("--modbus", "127.0.0.1:0")
GEAR, ALARM, VOLTAGE, SAVE, ADDRESS, ACTUAL, TARGET = 0x0C, 0x10, 0x13, 0x16, 0x17, 0x18, 0x1C
SPEED, TARGET_SPEED, CONTROLWORD, STATUSWORD, MODE = 0x02, 0x1E, 0x23, 0x24, 0x25


class Registers:
    """A unit's registers."""

    def __init__(self, client, unit):
        self.client, self.unit = client, unit

    def read(self, address, count=1):
        answer = self.client.read_holding_registers(address, count=count, device_id=self.unit)
        true(not answer.isError(), f"read {count} from {address:#x}: {answer}")
        return answer.registers

    def long(self, address):
        """A signed value of 32 bits, low word first."""
        low, high = self.read(address, 2)
        value = low | high << 16
        return value - (1 << 32) if value >> 31 else value

    def write(self, address, *words):
        answer = self.client.write_registers(address, list(words), device_id=self.unit)
        true(not answer.isError(), f"write {words} to {address:#x}: {answer}")

    def write_long(self, address, value):
        self.write(address, value & 0xFFFF, value >> 16 & 0xFFFF)


@contextlib.contextmanager
def registers(bench, unit=1):
    client = ModbusTcpClient("127.0.0.1", port=bench.simulator.port("modbus"), timeout=60)
    true(client.connect(), "pymodbus connects")
    try:
        # "0: modbus forbid" (2600h) is the value as delivered. There may be no listener.
        client.write_register(0, 1, device_id=unit)
        yield Registers(client, unit)
    finally:
        client.close()


@check("each register of the manual reads as its object does by SDO, 32 bits with the low word first", MJOINT, extra=SERVED)
def all_registers(bench):
    with registers(bench) as unit:
        for row in bench.drive.rows("objects.csv"):
            if not row["modbus"] or row["live"] == "yes":
                continue
            index, sub, words, address = int(row["index"], 16), int(row["sub"], 16), int(row["words"]), int(row["modbus"], 16)
            bits = bench.read(index, sub) & (0xFFFF if words == 1 else 0xFFFFFFFF)
            expected = [bits >> 16 * word & 0xFFFF for word in range(words)]
            equal(unit.read(address, words), expected, f"register {row['modbus']} ({row['name']})")
            inputs = unit.client.read_input_registers(address, count=words, device_id=1)
            equal(inputs.registers, expected, f"input register {row['modbus']}")
        near(unit.read(VOLTAGE)[0] / 327, 36, 0.5, "system voltage in V")


@check("pymodbus moves and turns the joint, and what it writes is read by SDO", MJOINT, extra=SERVED)
def moves(bench):
    with registers(bench) as unit:
        unit.write(MODE, 1)
        unit.write_long(SPEED, 1000)
        equal(bench.read(0x6081), 1000, "6081h")
        unit.write(CONTROLWORD, 0x2F)
        for target in (100_000, -70_000):
            unit.write_long(TARGET, target)
            eventually(lambda: unit.long(ACTUAL), lambda at: abs(at - target) <= 60, "actual position")
            eventually(lambda: unit.read(STATUSWORD)[0], lambda word: word == 0x0437, "the status word")
            bench.becomes(0x6064, target, bench.drive.close)
        unit.write(MODE, 3)
        unit.write_long(TARGET_SPEED, -300)
        bench.speed_becomes(-300)
        near(unit.read(0x12)[0] - 65536, -3000, 100, "motor actual speed, in 0.1 r/min")
        bench.world("supply 55")
        eventually(lambda: unit.read(ALARM), lambda code: code == [0x15], "the alarm code")
        bench.world("supply 36")
        eventually(lambda: unit.read(VOLTAGE)[0], lambda now: now / 327 < 50, "the system voltage falls")
        unit.write(ALARM, 0)
        equal(unit.read(ALARM), [0], "the alarm code after it was cleared")


REFUSED = table(
    "what ask exception",
    ("a read behind the last register", lambda c: c.read_holding_registers(0x27, count=1, device_id=1), 2),
    ("a read over the end", lambda c: c.read_holding_registers(0x25, count=4, device_id=1), 2),
    ("a write far off", lambda c: c.write_register(0x300, 1, device_id=1), 2),
    ("a write of the system voltage", lambda c: c.write_register(VOLTAGE, 1, device_id=1), 2),
    ("mode 2", lambda c: c.write_register(MODE, 2, device_id=1), 3),
    ("a gear over 0, which leaves its other half as it was", lambda c: c.write_registers(GEAR, [2000, 0], device_id=1), 3),
    ("a read of coils", lambda c: c.read_coils(0, count=1, device_id=1), 1),
    ("a unit that is not there", lambda c: c.read_holding_registers(ACTUAL, count=2, device_id=9), 0x0B),
)


@check("{what} gets exception {exception}", MJOINT, rows=REFUSED, extra=SERVED)
def refused(bench, row):
    with registers(bench) as unit:
        answer = row["ask"](unit.client)
        true(answer.isError(), f"it was answered: {answer}")
        equal(answer.exception_code, row["exception"], "exception")
        equal((unit.read(MODE), unit.read(GEAR, 2)), ([1], [32768, 8192]), "mode and gear afterwards")


@check("2600h = 0 forbids writes by Modbus but its own, and no reads; a unit without supply gives no answer", MJOINT, extra=SERVED)
def forbidden(bench):
    with registers(bench) as unit:
        unit.write(0, 0)
        equal(unit.client.write_register(MODE, 3, device_id=1).exception_code, 1, "exception of a write")
        equal(unit.read(MODE), [1], "the mode afterwards")
        unit.write(0, 1)
        unit.write(MODE, 3)
        equal(unit.read(MODE), [3], "the mode")
        bench.world("power cut")
        answer = unit.client.read_holding_registers(ACTUAL, count=2, device_id=1)
        equal(answer.exception_code, 0x0B, "exception without supply")


@check("two joints are two units of one gateway, and a saved address moves the unit", MJOINT, drives=("m4230e17b50@1", "m8025e25b80@7"), extra=SERVED)
def two_units(bench):
    second = bench.other(7)
    eventually(lambda: second.answers(10.0), bool, "node 7 answers")
    with registers(bench) as one, registers(bench, unit=7) as seven:
        equal([one.read(ADDRESS), seven.read(ADDRESS)], [[1], [7]], "device locations")
        seven.write_long(SPEED, 333)
        equal([bench.read(0x6081), second.read(0x6081)], [1500, 333], "6081h of each")
        seven.write(ADDRESS, 8)
        seven.write(SAVE, 1)
        eventually(lambda: seven.read(SAVE), lambda flag: flag == [2], "the save flag")
        bench.sleep(0.3)
        second.world("power cycle")
        eventually(lambda: second.world("get")["power"], lambda power: power == "on", "node 8 has booted")
        with registers(bench, unit=8) as eight:
            equal((eight.read(ADDRESS), eight.long(SPEED)), ([8], 333), "device location and speed of unit 8")


@contextlib.contextmanager
def serial_line():
    """A null modem of two pseudo terminals: the names of its ends."""
    try:
        import tty

        pairs = [os.openpty() for _ in range(2)]
    except (ImportError, AttributeError, OSError) as error:
        raise Skip(f"no pseudo terminals here: {error}") from None
    for _, end in pairs:
        tty.setraw(end)

    def pump(source, sink):
        with contextlib.suppress(OSError):
            while data := os.read(source, 256):
                os.write(sink, data)

    for source, sink in ((pairs[0][0], pairs[1][0]), (pairs[1][0], pairs[0][0])):
        threading.Thread(target=pump, args=(source, sink), daemon=True).start()
    try:
        yield [os.ttyname(end) for _, end in pairs]
    finally:
        for pair in pairs:
            for end in pair:
                os.close(end)


@check("pymodbus reads and moves the joint by Modbus RTU over a serial line", MJOINT, absent=True)
def serial(bench):
    with serial_line() as (drive_end, host_end):
        bench.extra += ["--modbus", f"rtu://{drive_end}?baud=115200"]
        bench.absent = False
        bench.restart()
        client = ModbusSerialClient(host_end, baudrate=115200, timeout=3, retries=20)
        true(client.connect(), "pymodbus opens the line")
        try:
            unit = Registers(client, 1)
            unit.write(0, 1)
            equal(unit.read(GEAR, 2), [32768, 8192], "the electronic gear")
            unit.write(CONTROLWORD, 0x2F)
            unit.write_long(TARGET, 40_000)
            eventually(lambda: unit.long(ACTUAL), lambda at: abs(at - 40_000) <= 30, "actual position")
            eventually(lambda: unit.read(STATUSWORD)[0], lambda word: word == 0x0437, "the status word")
            answer = client.read_holding_registers(0x1000, count=1, device_id=1)
            equal(answer.exception_code, 2, "exception of a read far off")
        finally:
            client.close()
            bench.stop()
            bench.extra = []
        bench.start()
