"""Shafts that a physics engine moves: what of it is not one world's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from . import _native
from .turns import active

if TYPE_CHECKING:
    from typing_extensions import Self

    from .world import World


class ExternalShaft(NamedTuple):
    """A shaft that a physics engine moves, at its joint. From :meth:`World.external_shafts`.

    >>> world.external([5])
    >>> world.external_shafts()[0].inertia_kg_m2 > 0
    True
    """

    #: The drive, and its axis if it has several.
    place: str
    #: Turns of the joint for one turn of the motor, negative for a motor that sits the other way round.
    turns: float
    #: Inertia of the drive at the joint in kg m^2: the armature that the engine needs there.
    inertia_kg_m2: float
    #: The most that its dry friction gives at the joint, brakes that are closed included, in N m. Part of the torque already.
    friction_nm: float
    #: Its torque at the joint less its friction in N m, the mean of the last exchange.
    torque_nm: float
    #: Where the shaft is, in rad.
    angle_rad: float
    #: How fast it turns, in rad/s.
    velocity_rad_s: float


class Worlds(_native.Worlds):
    """Several worlds that are exchanged together, on all cores: for environments side by side.

    :param worlds: each once; they may be used by themselves between two exchanges
    :raises ValueError: one is in the list twice

    >>> world = ferrodrive.World()
    >>> wheel = world.add("zlac8030l", node=4)
    >>> world.external([4])
    >>> worlds = ferrodrive.Worlds([world.snapshot() for _ in range(3)])
    >>> worlds.exchange(0.001, [[0.0]] * 3, [[0.0]] * 3).shape
    (3, 1)
    """

    def __new__(cls, worlds: Sequence[World]) -> Self:
        return super().__new__(cls, list(worlds))

    def __init__(self, worlds: Sequence[World]) -> None:
        self.worlds = list(worlds)

    def __len__(self) -> int:
        return len(self.worlds)

    def __getitem__(self, number: int) -> World:
        return self.worlds[number]

    def exchange(self, dt_s: float, angle_rad: Any, velocity_rad_s: Any) -> Any:
        """As :meth:`World.exchange`, with a row for each world: arrays of shape ``(worlds, shafts)`` in and out. What comes out is to the bit
        what each world gives by itself. All worlds are exchanged or none.

        :raises ValueError: a shape or a value is wrong, with the number of the world
        :raises RuntimeError: one of them is that of the virtual time in use (:func:`~ferrodrive.virtual_time`): its threads would not see
            this time pass; :meth:`World.exchange` moves it

        >>> world.external([5])
        >>> worlds = ferrodrive.Worlds([world, world.snapshot()])
        >>> worlds.exchange(0.001, [[0.0], [0.0]], [[0.0], [0.0]]).shape
        (2, 1)
        """
        time = active()
        if time is not None and any(world is time.world for world in self.worlds):
            raise RuntimeError("a world whose virtual time is in use is moved by its own exchange(): take it out of the list, or end that use")
        return super().exchange(dt_s, angle_rad, velocity_rad_s)
