"""What the motor does by SDO: speeds, positions, torque, halt and quick stop, and what the world sees of it."""

from checks import check, equal, eventually, near, table, true
from drive import ALL, MJOINT, ZL, ZLAC8030L, ZLIM42C

POSITION, VELOCITY, TORQUE = 1, 3, 4
#: Counts of 6064h in a turn of the motor.
TURN = {"zlac8030l": 4096, "zlim42c": 4000, "mjoint": 32_768}
#: What the statusword shows of the power state: enabled, and in quick stop.
ENABLED = {"zlac8030l": (0x6F, 0x27), "zlim42c": (0x6F, 0x27), "mjoint": (0xFF, 0x37)}
QUICK_STOP = {"zlac8030l": (0x6F, 0x07), "zlim42c": (0x6F, 0x07), "mjoint": (0xFF, 0x17)}


@check("profile velocity runs both ways at the speeds asked for, 6064h and the shaft with it, and bit 10 tells", *ALL)
def velocity(bench):
    for r_min in (60, -60, 200):
        bench.turn(r_min)
        bench.status_becomes(1 << 10, 1 << 10, "bit 10")
    bench.write_all(bench.drive.unwatched)
    first = bench.world("get")
    bench.sleep(1.0)
    last = bench.world("get")
    took = last["t"] - first["t"]
    turns = 200 / 60
    near((last["position"] - first["position"]) / took / TURN[bench.drive.name], turns, turns * 0.03, "turns a second of 6064h")
    near((last["shaft_angle_rad"] - first["shaft_angle_rad"]) / took / 6.2832, turns, turns * 0.03, "turns a second of the shaft")
    bench.write(0x60FF, 0)
    bench.speed_becomes(0)


@check("profile position goes there, there again, back and on by relative ways, at the speed of 6081h", *ALL)
def position(bench):
    bench.write_all(bench.drive.unwatched)
    bench.enable(POSITION)
    bench.write(0x6081, 300)
    turn = TURN[bench.drive.name]
    for target, relative, place in ((4 * turn, False, 4), (4 * turn, False, 4), (-2 * turn, False, -2), (3 * turn, True, 1), (-turn, True, 0)):
        bench.move(target, relative)
        near(bench.read(0x6064), place * turn, bench.drive.close, "6064h")
    bench.write(0x607A, 40 * turn)
    bench.write(0x6040, 0x0F)
    bench.write(0x6040, 0x1F)
    bench.speed_becomes(300)
    fastest = max(bench.read(0x606C) for _ in range(50))
    true(fastest <= 300 * bench.drive.per_rpm * 1.1, f"606Ch goes up to {fastest}")


@check("halt and quick stop bring the motor to rest as their states say, and Fh lets a velocity go on", *ALL)
def stops(bench):
    bench.write_all(bench.drive.unwatched)
    bench.turn(100)
    for controlword, (mask, state) in ((0x010F, ENABLED[bench.drive.name]), (0x0002, QUICK_STOP[bench.drive.name])):
        if bench.drive is MJOINT and controlword == 0x0002:
            controlword = 0x000B  # its power stage follows bit 1, and bit 0 says who commands
        bench.write(0x6040, controlword)
        bench.speed_becomes(0)
        bench.status_becomes(mask, state, f"the state after {controlword:04X}h")
        bench.write(0x6040, 0x000F)
        bench.status_becomes(*ENABLED[bench.drive.name], "the state after Fh")
        bench.speed_becomes(100)
    bench.write(0x6040, 0x0000)
    eventually(lambda: bench.world("get")["current_a"], lambda current: abs(current) < 0.05, "no current after 0h")


@check("a second set-point waits for the first when bit 5 is 0", *ZL)
def queued(bench):
    bench.write_all(bench.drive.unwatched)
    bench.enable(POSITION)
    bench.write(0x6081, 300)
    for target in (8000, 2000):
        bench.write(0x607A, target)
        bench.write(0x6040, 0x0F)
        bench.write(0x6040, 0x1F)
    bench.write(0x6040, 0x0F)
    furthest = max(bench.read(0x6064) for _ in iter(lambda: bench.statusword() & 0x5400 == 0x0400, True))
    true(furthest > 7000, f"the first set-point of 8000 was followed, got to {furthest}")
    bench.becomes(0x6064, 2000, bench.drive.close)


@check("profile torque puts 1000 mA and -1000 mA into a locked rotor", ZLAC8030L)
def torque(bench):
    bench.world("rotor lock")
    bench.write(0x6087, 20_000)
    bench.enable(TORQUE)
    for milliamperes in (1000, -1000):
        bench.write(0x6071, milliamperes)
        bench.becomes(0x6074, milliamperes)
        bench.becomes(0x6077, milliamperes // 100, 1)
    bench.status_becomes(1 << 10, 1 << 10, "bit 10 tells that the torque is reached")


WATCHES = table("watch rpm", (400, 0), (0, 100))


@check("with 2000h = {watch} and a silent host the motor turns at {rpm} r/min and stays enabled", ZLAC8030L, rows=WATCHES)
def host_watch(bench, row):
    bench.write(0x2000, row["watch"])
    bench.turn(100)
    bench.sleep(1.5)
    near(bench.world("get")["velocity_rpm"], row["rpm"], 2, "velocity by the world, after silence")
    bench.status_becomes(0x7F, 0x37, "enabled")
    equal(bench.read(0x603F), 0, "603Fh")


@check("a rotor that is held loses its steps: the drive arrives all the same, and the world knows better", ZLIM42C)
def lost_steps(bench):
    bench.enable(POSITION)
    bench.world("rotor lock")
    bench.move(4000)
    equal(bench.read(0x6064), 4000, "6064h")
    bench.world("rotor free")
    bench.sleep(0.5)
    get = bench.world("get")
    equal(get["position"], 4000, "the position that the drive reports")
    near(get["rotor_position"], 0, 12, "where the rotor is")
    bench.status_becomes(0x22FF, 0x2237, "the statusword, without a fault")
