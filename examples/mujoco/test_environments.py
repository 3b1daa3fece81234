"""The environments of Gymnasium: their contract, their seeds, their end by a fault."""

import time

import pytest

pytest.importorskip("mujoco")
gymnasium = pytest.importorskip("gymnasium")

import numpy  # noqa: E402
from gymnasium.utils.env_checker import check_env  # noqa: E402
from reach import Reach, straight_there  # noqa: E402
from square import Odometry, Square  # noqa: E402


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


def test_a_fault_ends_an_episode_with_its_reason(square):
    square.reset(seed=1)
    policy = Odometry()
    observation = square._observation()
    for step in range(500):
        observation, _, ended, _, info = square.step(policy(observation))
        if ended:
            break
        if step == 200:
            square.world[4].set_fault("hall")
    assert ended and info["fault"] == "node 4: fault 0200h, Hall sensor"
    _, info = square.reset(seed=1)
    assert info == {} and not square.step([30, -30])[2], "the snapshot knows nothing of the fault"


def test_steps_a_second(square, record_property):
    """Recorded, and not asked of a machine that does other things besides: docs/performance.md has the figure."""
    square.reset(seed=1)
    begin = time.process_time()
    for _ in range(500):
        square.step([30, -30])
    record_property("steps_per_cpu_second", round(500 / (time.process_time() - begin)))
