"""What the motor does by SDO: speeds, positions, halt and quick stop, and what the world sees of it."""

from checks import check, eventually, near, true
from drive import ALL, MJOINT

POSITION = 1
#: Counts of 6064h in a turn of the motor.
TURN = {"zlac8030l": 4096, "zlim42c": 4000, "mjoint": 32_768}
#: What the statusword shows of the power state: enabled, and in quick stop.
ENABLED = {"zlac8030l": (0x6F, 0x27), "zlim42c": (0x6F, 0x27), "mjoint": (0xFF, 0x37)}
QUICK_STOP = {"zlac8030l": (0x6F, 0x07), "zlim42c": (0x6F, 0x07), "mjoint": (0xFF, 0x17)}


@check("profile velocity runs both ways at the speeds asked for, 6064h and the shaft with it, and bit 10 reports it", *ALL)
def velocity(bench):
    for r_min in (60, -60, 200):
        bench.turn(r_min)
        bench.status_becomes(1 << 10, 1 << 10, "bit 10")
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
