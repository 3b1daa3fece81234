"""A machine that several drives move together: a base on two wheels, motors on one shaft, an arm."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Optional

from .words import Number, number, word

if TYPE_CHECKING:
    from .world import World


class Body:
    """A coupled machine of a world, by its name. What it does not take raises :class:`~ferrodrive.Refused`.

    >>> body = ferrodrive.World.machine("base.toml").body("base")
    >>> body.state()["x_m"]
    0.0
    """

    def __init__(self, world: World, name: str) -> None:
        self._world = world
        self._name = word(name)

    def __repr__(self) -> str:
        return f"<Body {self._name}>"

    def apply(self, words: str) -> dict[str, Any]:
        """Does what a world command says about it: ``apply("slope 5 90")``.

        :raises Refused: there is no such body, or it does not take the command; nothing has changed

        >>> body.apply("slope 5 90")["ok"]
        True
        """
        return self._world.apply(f"body {self._name} {words}")

    def _do(self, name: str, *values: Any) -> None:
        self._world.stimulate_body(self._name, name, *values)

    def state(self) -> dict[str, Any]:
        """True pose (``body base get``): of a base ``x_m``, ``y_m``, ``heading_deg``, ``speed_m_s`` and the slip of its
        wheels; of an arm ``joints_deg`` and ``tool_m``.

        >>> sorted(body.state())[0]
        'heading_deg'
        """
        state: dict[str, Any] = self.apply("get")["body"]
        return state

    def set_slope(self, degrees: Number, uphill_deg: Number = 0) -> None:
        """The ground rises by so many degrees, towards that direction in degrees from the x axis (``body base slope 5 90``).

        >>> body.set_slope(5, uphill_deg=90)
        """
        self._do("slope", number("degrees", degrees), number("uphill_deg", uphill_deg))

    def set_grip(self, share: Optional[Number]) -> None:
        """The wheels slip beyond this share of the weight on them (``body base grip 0.1``); None: never (``body base grip off``).

        >>> body.set_grip(0.1)
        """
        self._do("grip", None if share is None else number("share", share))

    def set_mass(self, mass_kg: Number) -> None:
        """Its mass in kg, as when it is loaded (``body base mass 60``).

        >>> body.set_mass(60)
        """
        self._do("mass", number("mass_kg", mass_kg))

    def set_payload(self, mass_kg: Number) -> None:
        """So many kg hang at the tool of an arm (``body arm payload 2``).

        >>> arm.set_payload(2)
        """
        self._do("payload", number("mass_kg", mass_kg))
