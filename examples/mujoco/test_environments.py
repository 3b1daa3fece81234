"""The environments of Gymnasium: their contract, their seeds, their end by a fault."""

import time

import pytest

pytest.importorskip("mujoco")
gymnasium = pytest.importorskip("gymnasium")

import numpy  # noqa: E402
from gymnasium.utils.env_checker import check_env  # noqa: E402
from reach import Reach, straight_there  # noqa: E402
from square import MOST_RPM, Odometry, Square  # noqa: E402
from squares import Squares  # noqa: E402


@pytest.fixture(scope="module")
def reach():
    return Reach()


@pytest.fixture(scope="module")
def square():
    return Square()


@pytest.mark.parametrize("name", ["reach", "square"])
def test_an_environment_keeps_the_contract_of_gymnasium(name, request):
    check_env(request.getfixturevalue(name), skip_render_check=True)


def episode(environment, policy, seed, most=None):
    observation, _ = environment.reset(seed=seed)
    seen, ended, cut, info = [observation], False, False, {}
    while not (ended or cut) and (most is None or len(seen) <= most):
        observation, _, ended, cut, info = environment.step(policy(observation))
        seen.append(observation)
    return numpy.array(seen), ended, info


def test_an_arm_reaches_its_goal_and_the_same_seed_gives_the_same_episode(reach):
    first, ended, info = episode(reach, straight_there, seed=3)
    assert ended and info == {}
    again, *_ = episode(reach, straight_there, seed=3)
    assert numpy.array_equal(first, again)
    other, *_ = episode(reach, straight_there, seed=4, most=10)
    assert not numpy.array_equal(first[:10], other[:10])


def test_a_base_drives_past_the_corners_of_its_square(square):
    seen, ended, info = episode(square, Odometry(), seed=1)
    assert ended and info == {}
    assert sorted(set(seen[:, 0, 2])) == [0, 1, 2, 3, 4]


@pytest.mark.parametrize(
    ("name", "stimulus", "reason"),
    [
        ("square", "4 fault hall on", "node 4: fault 0200h, Hall sensor"),
        ("reach", "2 supply 60", "node 2: fault 0015h, over-voltage"),
    ],
)
def test_a_fault_ends_an_episode_with_its_reason(name, stimulus, reason, request):
    environment = request.getfixturevalue(name)
    policy = Odometry() if name == "square" else straight_there
    observation, _ = environment.reset(seed=1)
    for step in range(500):
        observation, _, ended, _, info = environment.step(policy(observation))
        if ended:
            break
        if step == 200:
            environment.world.apply(stimulus)
    assert ended and info["fault"] == reason
    _, info = environment.reset(seed=1)
    nothing = numpy.zeros(environment.action_space.shape, numpy.int32)
    assert info == {} and not environment.step(nothing)[2], "the snapshot knows nothing of the fault"


#: Enough for a second thread (32 of a drive's milliseconds in a step), and odd.
MANY = 17


def test_many_bases_side_by_side_are_to_the_bit_what_each_is_alone():
    """The vector environment against single ones, for the same seeds and actions, over an end by a fault and the reset after it."""
    many = Squares(MANY)
    chance = numpy.random.default_rng(5)
    actions = chance.integers(-MOST_RPM, MOST_RPM, (24, MANY, 2)).repeat(5, axis=0)
    broken, at = 3, 60
    seen = [(*many.reset(seed=7), None)]
    for step, action in enumerate(actions):
        if step == at:
            many.squares[broken].world.apply("4 fault hall on")
        seen.append(many.step(action))
    ends = [step for step, of_all in enumerate(seen[1:]) if of_all[2].any()]
    assert len(ends) == 1 and ends[0] >= at, "the fault ends one episode, and its reset begins another"
    infos = seen[1 + ends[0]][4]
    assert list(infos["_fault"]) == [number == broken for number in range(MANY)]
    assert infos["fault"][broken] == "node 4: fault 0200h, Hall sensor"

    square = Square()
    for number in range(MANY):
        observation, _ = square.reset(seed=7 + number)
        assert numpy.array_equal(observation, seen[0][0][number])
        ended = False
        for step, action in enumerate(actions[:, number]):
            if number == broken and step == at:
                square.world.apply("4 fault hall on")
            if ended:
                observation, _ = square.reset()
                reward, ended, cut = 0.0, False, False
            else:
                observation, reward, ended, cut, _ = square.step(action)
            of_all = seen[1 + step]
            assert numpy.array_equal(observation, of_all[0][number]), (number, step)
            assert (reward, ended, cut) == (of_all[1][number], of_all[2][number], of_all[3][number]), (number, step)


def test_the_vector_environment_fits_its_spaces():
    many = Squares(2)
    observations, _ = many.reset(seed=1)
    assert many.observation_space.contains(observations)
    observations, rewards, *_ = many.step(many.action_space.sample())
    assert many.observation_space.contains(observations) and rewards.shape == (2,)
    with pytest.raises(ValueError):
        many.step(many.action_space.sample()[:1])


def test_steps_of_a_second_of_the_processor_are_recorded(square, record_property):
    """The figure is in docs/performance.md; no bound stands here, since a busy machine may be slower by any factor."""
    square.reset(seed=1)
    begin = time.process_time()
    for _ in range(500):
        square.step([30, -30])
    record_property("steps_per_cpu_second", round(500 / (time.process_time() - begin)))
    assert square.steps == 500
