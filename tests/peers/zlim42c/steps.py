"""The open loop: torque, lost steps, holding current (manual 1.1, 2.1, 5.4; hybrid steppers of 1.8 degrees)."""

from checks import check, equal, near, true
from zlim42c.axis import POSITION, POWER_STATE, PULSES_PER_TURN, go, rotor, runs, speed_becomes, stands

#: A rotor that loses its place finds it again a whole electrical turn away: four full steps, a 50th of a turn.
TOOTH = PULSES_PER_TURN / 50
HOLDING_TORQUE = {"zlim42c": 0.48, "zlim42c-82": 0.72}


def lost(bench):
    """Pulses that the rotor is behind 6064h, at rest and without load."""
    bench.world("load torque 0")
    bench.sleep(0.5)
    get = bench.world("get")
    equal(get["position"], bench.read(0x6064), "6064h and the world's position")
    return get["position"] - get["rotor_position"]


@check("a load within the motor's torque costs no step")
def light_load(bench):
    bench.write(0x6081, 120)
    bench.enable(POSITION)
    bench.world("load torque 0.1")
    go(bench, 8000, relative=True)
    near(lost(bench), 0, 8, "pulses lost")


@check("a load too heavy to be brought to speed at once loses steps, whole teeth, and the drive does not know")
def overload(bench):
    bench.world("load inertia 0.002")
    bench.write(0x6083, 0)
    bench.write(0x6084, 0)
    runs(bench, 300)
    bench.sleep(0.5)
    equal(bench.read(0x606C), 300, "606Ch under overload")
    equal(bench.read(0x603F), 0, "603Fh under overload")
    bench.status_becomes(POWER_STATE, 0x2237, "the statusword under overload")
    bench.write(0x60FF, 0)
    stands(bench)
    bench.world("rotor lock")
    bench.world("load inertia 0")
    bench.world("rotor free")
    pulses = lost(bench)
    true(pulses > 4 * TOOTH, f"many steps are lost, got {pulses} pulses")
    near(pulses / TOOTH, round(pulses / TOOTH), 0.12, "teeth lost")


@check("the same load is brought to the same speed by a ramp, without losing a step")
def ramped(bench):
    bench.world("load inertia 0.002")
    bench.write(0x6083, 2000)
    bench.write(0x6084, 2000)
    runs(bench, 120)
    bench.write(0x60FF, 0)
    stands(bench)
    near(lost(bench), 0, 20, "pulses lost")


@check("a locked rotor: the move ends as reached, and the rotor is where it was")
def locked(bench):
    bench.world("rotor lock")
    bench.write(0x6081, 300)
    bench.enable(POSITION)
    go(bench, 4000, relative=True)
    equal(bench.read(0x6064), 4000, "6064h")
    near(rotor(bench.world("get")), 0, 2, "where the rotor is")
    bench.world("rotor free")
    near(lost(bench), 4000, 12, "pulses lost")


for _model, _torque in HOLDING_TORQUE.items():

    @check(f"at rest with full current and 2005h = 7 the {_model} holds 85 % of {_torque} N·m and not 120 %", drives=(f"{_model}@1",))
    def holding(bench):
        bench.write(0x2005, 7)
        bench.write(0x2007, 1)
        torque = HOLDING_TORQUE[bench.drives[0].partition("@")[0]]
        bench.enable(POSITION)
        bench.sleep(0.3)
        # Come at once, a torque above 72 % would swing an undamped rotor over its crest.
        for part in range(1, 18):
            bench.world(f"load torque {0.05 * part * torque}")
            bench.sleep(0.05)
        bench.sleep(0.5)
        near(bench.world("get")["rotor_position"], 0, TOOTH / 4 + 2, "where the rotor is under 85 %, within a full step")
        bench.world(f"load torque {1.2 * torque}")
        bench.sleep(0.5)
        true(abs(bench.world("get")["rotor_position"]) > TOOTH, "the rotor gives way under 120 %")


@check("2005h decides what the motor can bring to speed: step 7 what step 0 cannot")
def current_steps(bench):
    # 120 r/min in 0.1 s on 0.0005 kg·m2 takes 0.063 N·m in the mean: 0.3 A of 2.2 A give no more at standstill.
    results = []
    bench.world("load inertia 0.0005")
    bench.write(0x6081, 120)
    for step in (7, 0):
        bench.write(0x2005, step)
        bench.enable(POSITION)
        go(bench, 8000, relative=True)
        bench.world("rotor lock")
        bench.world("rotor free")
        results.append(abs(lost(bench)))
        bench.write(0x6040, 0)
    true(results[0] < 8, f"no step lost with 2.2 A, got {results[0]} pulses")
    true(results[1] > TOOTH / 2, f"steps lost with 0.3 A, got {results[1]} pulses")


@check("at rest half the current flows with 2007h = 0, and all of it with 1")
def resting_current(bench):
    currents = []
    for full in (0, 1):
        bench.write(0x2007, full)
        bench.enable(POSITION)
        go(bench, 1000, relative=True)
        bench.sleep(0.6)
        currents.append(abs(bench.world("get")["current_a"]))
        bench.write(0x6040, 0)
        bench.sleep(0.05)
    true(currents[1] > 0.1, f"a current flows, got {currents}")
    near(currents[0] / currents[1], 0.5, 0.06, "half over full current")


def gives_way(bench, torque=0.05):
    """Whether the rotor moves away under a load of a short moment; then it stands again."""
    before = rotor(bench.world("get"))
    bench.world(f"load torque {torque}")
    bench.sleep(0.02)
    moved = abs(rotor(bench.world("get")) - before)
    bench.world("load torque 0")
    bench.world("rotor lock")
    bench.world("rotor free")
    bench.sleep(0.1)
    # A push may tip a held rotor from a dead point into its place, a tooth at most.
    return moved > 2 * TOOTH


@check("a disabled motor is free, and 200Bh = 1 locks it from power-on without enabling it")
def lock_at_power_on(bench):
    true(gives_way(bench), "the free rotor gives way")
    bench.write(0x200B, 1)
    bench.sleep(0.5)
    bench.power_cycle()
    equal(bench.statusword() & 0xFF, 0x70, "low byte: not enabled")
    bench.sleep(0.5)
    true(not gives_way(bench), "the locked rotor holds")


@check("the motor is energised from switched on, and released below")
def energised(bench):
    bench.write(0x6040, 0x06)
    for controlword, holds in ((0x07, True), (0x0F, True), (0x06, False)):
        bench.write(0x6040, controlword)
        bench.sleep(0.2)
        true(gives_way(bench) != holds, f"whether the rotor holds after 6040h = {controlword:02X}h")


@check("a lost phase is a fault only once the current matters, and the rotor does not follow")
def lost_phase(bench):
    bench.enable(POSITION)
    bench.world("fault phase on")
    bench.write(0x60FF, 60)
    bench.write(0x6040, 0x4F)
    bench.write(0x607A, 4000)
    bench.write(0x6040, 0x5F)
    bench.status_becomes(1 << 3, 1 << 3, "fault")
    equal(bench.read(0x603F), 0xFF04, "603Fh")


@check("the torque falls with the speed: what turns slowly does not start at 3000 r/min at once")
def torque_over_speed(bench):
    bench.write(0x6083, 0)
    bench.write(0x200E, 300)
    runs(bench, 3000)
    bench.sleep(0.3)
    true(abs(bench.world("get")["velocity_rpm"]) < 1500, "the rotor does not follow a step to 3000 r/min")
    bench.write(0x60FF, 0)
    speed_becomes(bench, 0)
    bench.write(0x6083, 2000)
    runs(bench, 600)
    first = bench.world("get")
    bench.sleep(0.3)
    second = bench.world("get")
    rate = (rotor(second) - rotor(first)) / (second["t"] - first["t"])
    near(rate, 40000, 1200, "pulses a second of the rotor, ramped up to 600 r/min")
