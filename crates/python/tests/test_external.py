"""Shafts that a physics engine moves: arrays in and out, several worlds at once, and what is refused."""

import subprocess
import sys
import threading
import time

import ferrodrive
import pytest

numpy = pytest.importorskip("numpy")

MACHINE = """
[[drive]]
model = "m4230e17b50"
node = 1
[[drive]]
model = "m4230e17b50"
node = 2
[[body]]
name = "hands"
kind = "external"
drives = [1, 2]
turns = [1, -1]
first_deg = [90, 0]
"""


def wheels(**options):
    world = ferrodrive.World(seed=3)
    for node in (4, 5):
        world.add("zlac8030l", node=node)
    world.external([4, 5], turns=(1, -1), **options)
    world.run_for(0.1)
    return world


def swing(world, steps, offset=0.0):
    """Torques of an imposed swing."""
    torques = []
    for step in range(steps):
        t = step * 0.001
        angle = numpy.sin(20 * t + offset) - numpy.sin(offset)
        torques.append(world.exchange(0.001, [angle, -angle], numpy.full(2, 20 * numpy.cos(20 * t + offset)) * (1, -1)))
    return numpy.array(torques)


def test_arrays_of_any_kind_go_in_and_a_new_one_comes_out():
    world = wheels()
    angles = numpy.zeros((2, 3), numpy.float32)[:, 1]
    torque = world.exchange(0.001, angles, (0, 0))
    assert torque.dtype == numpy.float64 and torque.shape == (2,)
    assert torque is not world.exchange(0.001, angles, [0, 0])
    assert world.now_ns == 102_000_000


def test_a_shaft_says_what_the_engine_has_to_have():
    left, right = wheels().external_shafts()
    assert (left.place, right.place) == ("4", "5")
    assert (left.turns, right.turns) == (1, -1)
    # crates/plant/src/hub_motors.rs: a disc of 3.75 kg and 173 mm; half of the torque without load is dry.
    assert left.inertia_kg_m2 == pytest.approx(0.014)
    assert left.friction_nm == pytest.approx(0.099)


def test_a_snapshot_goes_on_with_the_same_torques():
    world = wheels()
    swing(world, 10)
    before = world.snapshot()
    first = swing_on(world)
    world.restore(before)
    assert numpy.array_equal(first, swing_on(world))
    assert numpy.array_equal(first, swing_on(before))


def swing_on(world):
    angles = numpy.array([shaft.angle_rad for shaft in world.external_shafts()])
    return numpy.array([world.exchange(0.001, angles + (0.01 * step, 0), [10, 0]) for step in range(20)])


@pytest.mark.parametrize("count", [1, 7, 25])
def test_worlds_side_by_side_are_to_the_bit_what_each_is_alone(count):
    """25 worlds of two drives are enough for a second thread at steps of 1 ms, and no number of cores divides them evenly but 5 and 25."""
    offsets = [0.1 * number for number in range(count)]
    alone = [swing(wheels(), 30, offset) for offset in offsets]
    worlds = ferrodrive.Worlds([wheels() for _ in offsets])
    assert len(worlds) == count
    together = []
    for step in range(30):
        t = step * 0.001
        angle = numpy.array([numpy.sin(20 * t + offset) - numpy.sin(offset) for offset in offsets])
        speed = numpy.array([20 * numpy.cos(20 * t + offset) for offset in offsets])
        together.append(worlds.exchange(0.001, numpy.stack([angle, -angle], 1), numpy.stack([speed, -speed], 1)))
    assert numpy.array_equal(numpy.array(together).swapaxes(0, 1), numpy.array(alone))
    assert [world.now_ns for world in worlds.worlds] == [130_000_000] * count


@pytest.mark.parametrize(
    "kind",
    [
        numpy.asfortranarray,
        lambda numbers: numbers.astype(">f8"),
        lambda numbers: numbers.astype(numpy.float32),
        lambda numbers: numpy.repeat(numbers, 2, axis=1)[:, ::2],
        lambda numbers: numbers[::-1][::-1],
        numpy.ndarray.tolist,
    ],
)
def test_rows_are_the_same_in_any_layout(kind):
    # Exact in 32 bits, too.
    speed = numpy.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])
    angle = speed / 1024
    plain, other = (ferrodrive.Worlds([wheels() for _ in angle]) for _ in range(2))
    expected = plain.exchange(0.001, angle, speed)
    assert numpy.array_equal(other.exchange(0.001, kind(angle), kind(speed)), expected)
    assert numpy.array_equal(expected[1], wheels().exchange(0.001, kind(angle)[1], kind(speed)[1]))


def test_of_several_worlds_all_are_exchanged_or_none():
    worlds = ferrodrive.Worlds([wheels(), wheels()])
    good = numpy.zeros((2, 2))
    bad = good.copy()
    bad[1, 0] = numpy.nan
    with pytest.raises(ValueError, match="world 1: the angle of joint 1 is NaN"):
        worlds.exchange(0.001, bad, good)
    assert [world.now_ns for world in worlds.worlds] == [100_000_000] * 2
    with pytest.raises(ValueError, match="a row for each of 2 worlds, got 3 rows"):
        worlds.exchange(0.001, numpy.zeros((3, 2)), numpy.zeros((3, 2)))
    with pytest.raises(ValueError, match="a row for each of 2 worlds"):
        worlds.exchange(0.001, [0.0, 0.0], good)
    with pytest.raises(ValueError, match="world 0: expected 2 values"):
        worlds.exchange(0.001, numpy.zeros((2, 1)), numpy.zeros((2, 1)))
    with pytest.raises(ValueError, match="twice"):
        ferrodrive.Worlds([worlds[0], worlds[0]])
    with ferrodrive.virtual_time(worlds[1]), pytest.raises(RuntimeError, match="moved by its own exchange"):
        worlds.exchange(0.001, good, good)


def test_an_array_that_asks_the_world_itself_does_not_wait_for_it():
    world = wheels()

    class Angles:
        def __array__(self, dtype=None, copy=None):
            assert len(world.external_shafts()) == 2
            return numpy.zeros(2)

    with ferrodrive.virtual_time(world):
        assert world.exchange(0.001, Angles(), [0.0, 0.0]).shape == (2,)


@pytest.mark.parametrize("many", [False, True])
def test_other_threads_run_while_time_passes_in_an_exchange(many):
    """The interpreter takes its lock from no thread here that does not give it: the other runs in the middle of an exchange or never."""
    world = wheels()
    worlds = ferrodrive.Worlds([wheels()]) if many else None
    gate, steps, seen, done = threading.Semaphore(0), [], [], []

    def other():
        while not done:
            gate.acquire()
            seen.append(len(steps))

    interval = sys.getswitchinterval()
    sys.setswitchinterval(3600)
    thread = threading.Thread(target=other)
    try:
        thread.start()
        for step in range(1000):
            gate.release()
            if worlds:
                worlds.exchange(0.1, [[0.0, 0.0]], [[0.0, 0.0]])
            else:
                world.exchange(0.1, [0.0, 0.0], [0.0, 0.0])
            if len(seen) > len(steps):
                break
            steps.append(step)
        assert len(steps) < 1000
    finally:
        sys.setswitchinterval(interval)
        done.append(True)
        gate.release()
        thread.join()


def test_a_copy_of_a_world_adds_drives_of_its_fidelity():
    world = ferrodrive.World(fidelity="mechanical")
    copy = world.snapshot()
    for each in (world, copy):
        each.add("zlac8030l", node=4)
    world.run_for(0.5)
    copy.run_for(0.5)
    assert copy.digest() == world.digest()


@pytest.mark.parametrize(
    ("dt", "angles", "speeds", "said"),
    [
        (0.001, [0.0], [0.0], "expected 2 values, one for each external shaft"),
        (0.001, [0.0, 0.0], [0.0, float("inf")], "the velocity of joint 2 is inf"),
        (0.001, [0.0, 0.0], [float("nan"), 0.0], "the velocity of joint 1 is NaN"),
        (0.0, [0.0, 0.0], [0.0, 0.0], "a step of more than 0 s"),
        (-0.001, [0.0, 0.0], [0.0, 0.0], "a step of more than 0 s"),
        (float("nan"), [0.0, 0.0], [0.0, 0.0], "a step of more than 0 s"),
        (0.00101, [0.0, 0.0], [0.0, 0.0], "a whole number of control periods"),
        (0.001, [-2.0, 0.0], [0.0, 0.0], "further than its velocities explain"),
        (0.001, [[0.0, 0.0]], [0.0, 0.0], "angle_rad: expected an array of numbers with one dimension"),
        (0.001, ["a", "b"], [0.0, 0.0], "angle_rad: expected an array"),
    ],
)
def test_what_makes_no_sense_is_refused_and_no_time_passes(dt, angles, speeds, said):
    world = wheels()
    before = world.now_ns, world.digest()
    with pytest.raises(ValueError, match=said):
        world.exchange(dt, angles, speeds)
    assert (world.now_ns, world.digest()) == before


def test_joining_names_what_is_wrong():
    world = ferrodrive.World()
    world.add("zlac8030l", node=4)
    with pytest.raises(ValueError, match="expected hold, interpolate, integrate or torque"):
        world.external([4], rule="guess")
    with pytest.raises(ValueError, match="turns: 2 values for 1 drives"):
        world.external([4], turns=[1, 1])
    with pytest.raises(ferrodrive.Refused, match="there is no drive 9"):
        world.external([9])
    with pytest.raises(ValueError, match="one to 7"):
        world.external([])
    with pytest.raises(ValueError, match="no shaft of this world is moved from outside"):
        world.exchange(0.001, [], [])
    world.external([4])
    with pytest.raises(ferrodrive.Refused, match="part of a body already"):
        world.external([4], name="again")
    with pytest.raises(ValueError, match="take an angle and a velocity in"):
        world.exchange_torque(0.001, [0.0])


def test_the_other_form_moves_what_the_drive_has_to_move():
    world = wheels(rule="torque", inertia_kg_m2=0.086)
    friction = world.external_shafts()[0].friction_nm
    for _ in range(100):
        angle, velocity = world.exchange_torque(0.001, [friction + 1.0, 0.0])
    assert velocity == pytest.approx([1.0 / (0.086 + 0.014) * 0.1, 0], rel=0.03)
    assert angle == pytest.approx([0.5 * 10 * 0.01, 0], rel=0.03)


def test_a_machine_file_joins_them(tmp_path):
    (tmp_path / "hands.toml").write_text(MACHINE, encoding="utf-8")
    world = ferrodrive.World.machine(tmp_path / "hands.toml")
    assert [round(shaft.angle_rad, 4) for shaft in world.external_shafts()] == [1.5708, 0]
    assert world.body("hands").state()["kind"] == "external"
    world.exchange(0.002, [numpy.pi / 2, 0], [0, 0])


def test_in_virtual_time_an_engine_steps_while_the_program_sleeps():
    world = wheels()
    steps, stop = [], threading.Event()

    def engine():
        while not stop.is_set():
            steps.append(world.exchange(0.001, [0.0, 0.0], [0.0, 0.0]))

    with ferrodrive.virtual_time(world):
        thread = threading.Thread(target=engine)
        thread.start()
        time.sleep(0.05)
        assert 49 <= len(steps) <= 51
        stop.set()
        thread.join()
    assert all(step.shape == (2,) for step in steps)


def test_without_numpy_the_rest_works_and_an_exchange_says_what_it_needs():
    program = (
        "import sys; sys.modules['numpy'] = None; import ferrodrive; world = ferrodrive.World(); world.add('zlac8030l', node=4)\n"
        "world.run_for(0.1)\ntry:\n    world.external([4])\nexcept ImportError as error:\n    print(error)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "an exchange with a physics engine takes arrays: pip install numpy\n"
