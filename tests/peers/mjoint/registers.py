"""The manual's Modbus addresses with pymodbus: Modbus TCP, and RTU over a pair of pseudo terminals (5.04)."""

import contextlib
import os
import threading

from pymodbus.client import ModbusSerialClient, ModbusTcpClient

from checks import Skip, check, equal, eventually, near, true
from mjoint import rows
from mjoint.joint import POSITION, is_at, speed_becomes

SERVED = ("--modbus", "127.0.0.1:0")
ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE, NO_ANSWER_BEHIND_GATEWAY = 1, 2, 3, 0x0B
OUTPUT, SPEED, SLOPE, GEAR, ALARM, VOLTAGE, SAVE = 0x01, 0x02, 0x04, 0x0C, 0x10, 0x13, 0x16
ADDRESS, ACTUAL, TARGET, TARGET_SPEED, CONTROLWORD, STATUSWORD, MODE = 0x17, 0x18, 0x1C, 0x1E, 0x23, 0x24, 0x25


class Registers:
    """A unit's registers, by name of what they hold."""

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
        if len(words) == 1:
            answer = self.client.write_register(address, words[0], device_id=self.unit)
        else:
            answer = self.client.write_registers(address, list(words), device_id=self.unit)
        true(not answer.isError(), f"write {words} to {address:#x}: {answer}")

    def write_long(self, address, value):
        self.write(address, value & 0xFFFF, value >> 16 & 0xFFFF)


@contextlib.contextmanager
def registers(bench, unit=None):
    client = ModbusTcpClient("127.0.0.1", port=bench.simulator.port("modbus"), timeout=3)
    true(client.connect(), "pymodbus connects")
    # "0: modbus forbid" (2600h) is the value as delivered. Nobody may be there to hear it.
    client.write_register(0, 1, device_id=bench.node_id if unit is None else unit)
    try:
        yield Registers(client, bench.node_id if unit is None else unit)
    finally:
        client.close()


def refused(answer, code, what):
    true(answer.isError(), f"{what} was answered: {answer}")
    equal(answer.exception_code, code, f"exception of {what}")


@check("each register of the manual reads as its object does by SDO, 32 bits with the low word first", extra=SERVED)
def all_registers(bench):
    with registers(bench) as unit:
        for row in rows("objects.csv"):
            if not row["modbus"] or row["live"] == "yes":
                continue
            index, sub, words = int(row["index"], 16), int(row["sub"], 16), int(row["words"])
            bits = bench.read(index, sub) & (0xFFFF if words == 1 else 0xFFFFFFFF)
            seen = unit.read(int(row["modbus"], 16), words)
            equal(seen, [bits >> 16 * word & 0xFFFF for word in range(words)], f"register {row['modbus']} ({row['name']})")


@check("the addresses are the ones that the manual prints", extra=SERVED)
def addresses(bench):
    with registers(bench) as unit:
        near(unit.read(VOLTAGE)[0] / 327, 36, 0.5, "system voltage in V")
        equal(unit.read(ADDRESS), [1], "device location")
        equal(unit.read(STATUSWORD), [0x0404], "status word")
        equal(unit.read(GEAR, 2), [32768, 8192], "the electronic gear")
        equal(unit.long(ACTUAL), bench.read(0x6064), "actual position")


@check("input registers read as holding registers do", extra=SERVED)
def input_registers(bench):
    with registers(bench) as unit:
        answer = unit.client.read_input_registers(GEAR, count=2, device_id=1)
        equal(answer.registers, [32768, 8192], "the electronic gear")


@check("pymodbus moves the joint to an absolute position, there and below zero", extra=SERVED)
def moves(bench):
    with registers(bench) as unit:
        unit.write(MODE, POSITION)
        unit.write_long(SPEED, 1000)
        unit.write(CONTROLWORD, 0x2F)
        for target in (100_000, -70_000):
            unit.write_long(TARGET, target)
            eventually(lambda: unit.read(STATUSWORD)[0], lambda word: word == 0x0437, "the status word", 12)
            near(unit.long(ACTUAL), target, 60, "actual position")
            is_at(bench, target)


@check("pymodbus runs the joint in speed mode and stops it", extra=SERVED)
def runs(bench):
    with registers(bench) as unit:
        unit.write(MODE, 3)
        unit.write_long(TARGET_SPEED, -300)
        unit.write(CONTROLWORD, 0x0F)
        speed_becomes(bench, -300)
        signed = lambda word: word - 65536 if word > 32767 else word
        near(signed(unit.read(0x12)[0]), -3000, 100, "motor actual speed, in 0.1 r/min")
        unit.write(CONTROLWORD, 0x010F)
        speed_becomes(bench, 0)


@check("what is written by Modbus is read by SDO, and the reverse", extra=SERVED)
def both_ways(bench):
    with registers(bench) as unit:
        unit.write_long(SLOPE, 12_345)
        equal(bench.read(0x6083), 12_345, "6083h")
        bench.write(0x60F9, 1111, sub=1)
        equal(unit.read(0x07), [1111], "register 07h")


@check("several registers are written by one request, all or none", extra=SERVED)
def all_or_none(bench):
    with registers(bench) as unit:
        unit.write(GEAR, 1000, 500)
        equal([bench.read(0x260A), bench.read(0x260B)], [1000, 500], "260Ah and 260Bh")
        # 260Bh begins at 1.
        refused(unit.client.write_registers(GEAR, [2000, 0], device_id=1), ILLEGAL_VALUE, "a gear over 0")
        equal([bench.read(0x260A), bench.read(0x260B)], [1000, 500], "260Ah and 260Bh")


@check("an address that is not in the manual gets exception 02, a value out of range 03, another function 01", extra=SERVED)
def exceptions(bench):
    with registers(bench) as unit:
        read = lambda address, count=1: unit.client.read_holding_registers(address, count=count, device_id=1)
        write = lambda address, value: unit.client.write_register(address, value, device_id=1)
        refused(read(0x27), ILLEGAL_ADDRESS, "a read behind the last register")
        refused(read(0x1000), ILLEGAL_ADDRESS, "a read far off")
        refused(read(0x25, 4), ILLEGAL_ADDRESS, "a read over the end")
        refused(write(0x300, 1), ILLEGAL_ADDRESS, "a write far off")
        refused(write(VOLTAGE, 1), ILLEGAL_ADDRESS, "a write of the system voltage")
        refused(write(MODE, 2), ILLEGAL_VALUE, "mode 2")
        refused(write(OUTPUT, 2), ILLEGAL_VALUE, "output 2")
        refused(unit.client.read_coils(0, count=1, device_id=1), ILLEGAL_FUNCTION, "a read of coils")
        equal(unit.read(MODE), [1], "the mode afterwards")


@check("2600h = 0 forbids writes by Modbus but its own, with exception 01, and no reads", extra=SERVED)
def forbidden(bench):
    with registers(bench) as unit:
        unit.write(0, 0)
        refused(unit.client.write_register(MODE, 3, device_id=1), ILLEGAL_FUNCTION, "a write of the mode")
        equal(unit.read(MODE), [1], "the mode afterwards")
        unit.write(0, 1)
        unit.write(MODE, 3)
        equal(unit.read(MODE), [3], "the mode")


@check("a unit that is not there gets no answer but the gateway's exception 0B", extra=SERVED)
def wrong_unit(bench):
    with registers(bench, unit=9) as nobody:
        refused(nobody.client.read_holding_registers(ACTUAL, count=2, device_id=9), NO_ANSWER_BEHIND_GATEWAY, "unit 9")
        # Switched off it would live on its capacitors for a while.
        bench.world("power cut")
        refused(nobody.client.read_holding_registers(ACTUAL, count=2, device_id=1), NO_ANSWER_BEHIND_GATEWAY, "a unit without supply")


@check("parameters are saved by Modbus, and the flag reads 2 when done", extra=SERVED)
def saves(bench):
    with registers(bench) as unit:
        unit.write_long(SPEED, 777)
        unit.write(SAVE, 1)
        eventually(lambda: unit.read(SAVE), lambda flag: flag == [2], "the save flag")
        bench.sleep(0.3)
        bench.power_cycle()
        equal(bench.read(0x6081), 777, "6081h after the power cycle")


@check("the alarm is read and cleared by Modbus", extra=SERVED)
def alarm(bench):
    with registers(bench) as unit:
        bench.world("supply 55")
        eventually(lambda: unit.read(ALARM), lambda code: code == [0x15], "the alarm code")
        bench.world("supply 36")
        eventually(lambda: unit.read(VOLTAGE)[0], lambda now: now / 327 < 50, "the system voltage falls")
        unit.write(ALARM, 0)
        equal(unit.read(ALARM), [0], "the alarm code")


@check("two joints are two units of one gateway, and a changed address moves the unit", drives=("m4230e17b50@1", "m8025e25b80@7"), extra=SERVED)
def two_units(bench):
    second = bench.other(7)
    eventually(second.answers, bool, "node 7 answers")
    with registers(bench) as one, registers(bench, unit=7) as seven:
        equal([one.read(ADDRESS), seven.read(ADDRESS)], [[1], [7]], "device locations")
        seven.write_long(SPEED, 333)
        equal([bench.read(0x6081), second.read(0x6081)], [1500, 333], "6081h of each")
        seven.write(ADDRESS, 8)
        seven.write(SAVE, 1)
        eventually(lambda: seven.read(SAVE), lambda flag: flag == [2], "the save flag")
        bench.sleep(0.3)
        second.world("power cycle")
        bench.sleep(0.5)
        with registers(bench, unit=8) as eight:
            equal(eight.read(ADDRESS), [8], "device location of unit 8")


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


@check("pymodbus reads and moves the joint by Modbus RTU over a serial line", absent=True)
def serial(bench):
    with serial_line() as (drive_end, host_end):
        bench.extra += ["--modbus", f"rtu://{drive_end}?baud=115200"]
        bench.absent = False
        bench.restart()
        client = ModbusSerialClient(host_end, baudrate=115200, timeout=3)
        true(client.connect(), "pymodbus opens the line")
        try:
            unit = Registers(client, 1)
            unit.write(0, 1)
            equal(unit.read(GEAR, 2), [32768, 8192], "the electronic gear")
            unit.write(CONTROLWORD, 0x2F)
            unit.write_long(TARGET, 40_000)
            eventually(lambda: unit.read(STATUSWORD)[0], lambda word: word == 0x0437, "the status word", 12)
            near(unit.long(ACTUAL), 40_000, 30, "actual position")
            refused(client.read_holding_registers(0x1000, count=1, device_id=1), ILLEGAL_ADDRESS, "a read far off")
        finally:
            client.close()
            bench.stop()
            bench.extra = []
        bench.start()
