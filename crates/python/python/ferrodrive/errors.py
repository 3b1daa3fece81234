"""What can go wrong, as exceptions."""

from __future__ import annotations

from typing import Any, Optional

#: Kind, what, because, do, and (node, object, abort code): what the native half has of a failure.
Parts = tuple[str, str, list[str], list[str], tuple[Optional[int], Optional[tuple[int, int]], Optional[int]]]


class FerrodriveError(Exception):
    """Base of what this package raises of its own.

    >>> issubclass(ferrodrive.MasterError, ferrodrive.FerrodriveError)
    True
    """


class Refused(FerrodriveError, ValueError):
    """A drive or a world does not accept what was asked of it; nothing has changed.

    >>> world.apply("5 supply -3")
    Traceback (most recent call last):
    ferrodrive.errors.Refused: ...
    """


class Stalled(FerrodriveError, RuntimeError):
    """Every thread waits for something that can never happen any more, or for longer than allowed.

    >>> issubclass(ferrodrive.Stalled, RuntimeError)
    True
    """


class TimeInUse(FerrodriveError, RuntimeError):
    """The virtual time of another world is in use already.

    >>> with ferrodrive.virtual_time(world), ferrodrive.virtual_time(ferrodrive.World()):
    ...     pass
    Traceback (most recent call last):
    ferrodrive.errors.TimeInUse: ...
    """


class MasterError(FerrodriveError, RuntimeError):
    """The master could not do what it was asked to: a drive refused, was silent, or did not get there.

    The message has what was not done, where, what was expected and found, and what to do next; the same is in the attributes, in the
    words of ``--json`` (docs/json.md). :class:`NoAnswer`, :class:`Aborted`, :class:`NotReached` and :class:`BadRequest` are the kinds that
    a program is most likely to distinguish.

    >>> try:
    ...     network.upload(9, 0x1000)
    ... except ferrodrive.MasterError as error:
    ...     error.kind, error.where, error.what
    ('no_answer', 'node 9, 1000h:00', 'node 9 did not answer within 500 ms when asked to read 1000h:00')
    """

    #: What kind it is, in a word that programs may rely on: ``no_answer``, ``aborted``, ``not_reached``, ``usage``, ...
    kind: str = "failed"
    #: What was not done.
    what: str = ""
    #: What was expected and what was found, a sentence each.
    because: tuple[str, ...] = ()
    #: What to do next, a sentence each.
    do: tuple[str, ...] = ()
    #: Node that it is about, 1 to 127.
    node: Optional[int] = None
    #: Index and sub-index of the object that it is about.
    object: Optional[tuple[int, int]] = None
    #: SDO abort code that the node answered with (CiA 301, clause 7.2.4.3.17).
    abort_code: Optional[int] = None
    #: What was done as far as it went, where there is something: of a boot-up the report of :meth:`Network.boot`.
    report: Any = None

    @property
    def where(self) -> str:
        """Node and object that it is about, such as ``node 5, 6083h:00``; empty where it is about none."""
        node = "" if self.node is None else f"node {self.node}"
        of = "" if self.object is None else f"{self.object[0]:04X}h:{self.object[1]:02X}"
        return ", ".join(part for part in (node, of) if part)


class NoAnswer(MasterError):
    """A node did not answer in time.

    >>> network.upload(9, 0x1000)
    Traceback (most recent call last):
    ferrodrive.errors.NoAnswer: ...
    """


class Aborted(MasterError):
    """A node refused an SDO transfer; :attr:`abort_code` is its code.

    >>> try:
    ...     network.upload(5, 0x5FFF)
    ... except ferrodrive.Aborted as error:
    ...     hex(error.abort_code or 0)
    '0x6020000'
    """


class NotReached(MasterError):
    """A motion, a homing or a state was not reached; :attr:`because` has what was seen.

    >>> world[5].lock_rotor()
    >>> drive.velocity(60)
    Traceback (most recent call last):
    ferrodrive.errors.NotReached: ...
    """


class BadRequest(MasterError, ValueError):
    """What was asked for makes no sense as it stands, or is beyond what the drive takes: nothing was tried.

    >>> network.group("arm")
    Traceback (most recent call last):
    ferrodrive.errors.BadRequest: ...
    """


#: Which class a kind is of.
_CLASSES: dict[str, type[MasterError]] = {
    "no_answer": NoAnswer,
    "aborted": Aborted,
    "not_reached": NotReached,
    "usage": BadRequest,
    "bad_file": BadRequest,
    "out_of_limits": BadRequest,
    "too_fine": BadRequest,
}


def made(message: str, parts: Parts) -> MasterError:
    """The exception for a failure of the native half."""
    kind, what, because, do, (node, of, abort_code) = parts
    error = _CLASSES.get(kind, MasterError)(message)
    error.kind, error.what, error.because, error.do = kind, what, tuple(because), tuple(do)
    error.node, error.object, error.abort_code = node, of, abort_code
    return error


class SimulatorError(FerrodriveError, RuntimeError):
    """The program ``ferrodrive sim`` did not start, ended, or refused a world command.

    >>> with ferrodrive.Simulator([], path="/nowhere/ferrodrive"):
    ...     pass
    Traceback (most recent call last):
    ferrodrive.errors.SimulatorError: ...
    """


class BusWarning(UserWarning):
    """What a real bus reports beside frames: a connection that is lost or back, errors on the wire, a controller that is bus-off.

    Each kind is reported once for each network, a connection each time. ``warnings.simplefilter("error", ferrodrive.BusWarning)`` makes
    an exception of it.

    >>> issubclass(ferrodrive.BusWarning, UserWarning)
    True
    """
