"""What can go wrong, as exceptions."""

from __future__ import annotations

from typing import Optional


class FerrodriveError(Exception):
    """Base of what this package raises of its own."""


class Refused(FerrodriveError, ValueError):
    """A drive or a world does not take what it was told to; nothing has changed."""


class Stalled(FerrodriveError, RuntimeError):
    """Everybody waits for something that can never happen any more, or for longer than allowed."""


class TimeInUse(FerrodriveError, RuntimeError):
    """A virtual time is in use already, and this is another."""


class MasterError(FerrodriveError, RuntimeError):
    """The master could not do what it was asked to: a drive refused, was silent, or did not get there.

    The message says what, which node, which object, what the drive said and what to do next.
    """

    #: Node that it is about, 1 to 127.
    node: Optional[int] = None
    #: Index and sub-index of the object that it is about.
    object: Optional[tuple[int, int]] = None
    #: SDO abort code that the node answered with (CiA 301, clause 7.2.4.3.17).
    abort_code: Optional[int] = None


class SimulatorError(FerrodriveError, RuntimeError):
    """The program `ferrodrive sim` did not start, ended, or refused a world command."""


class BusWarning(UserWarning):
    """What a real bus says beside frames: a connection that is lost or back, errors on the wire, a controller that is bus-off.

    Each kind is told once for each network, a connection each time. ``warnings.simplefilter("error", ferrodrive.BusWarning)`` makes
    an exception of it.
    """
