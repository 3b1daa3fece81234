"""A world as a bus of python-can: ``can.Bus(interface="ferrodrive", channel=...)``.

The channel is a :class:`~ferrodrive.World`, the name of one (``World(channel="can0")``), or drives to make one of
(``"zlac8030l@4 m4230e17b50@1"``). All buses of one channel are adapters on one wire.

Time is virtual unless a pace is given: from the first bus that is opened until the last one is shut down it goes only as far as the
program waits (see :func:`ferrodrive.virtual_time`). With ``pace=1.0`` it is that of the clock, with ``pace=10.0`` ten times as
fast.
"""

from __future__ import annotations

from typing import Any, Optional, Union

import can

from . import stand_ins, turns
from .pace import Pace
from .world import World, at_channel


class FerrodriveBus(can.BusABC):
    """An adapter on the bus of a world.

    :param channel: a world, the name of one, or drives to make one of
    :param pace: ``"virtual"``, or virtual seconds for each second of the clock
    :param bitrate: if given, checked against that of the world, in bit/s
    """

    def __init__(
        self,
        channel: Any,
        can_filters: Optional[can.typechecking.CanFilters] = None,
        pace: Union[str, float] = "virtual",
        bitrate: Optional[int] = None,
        receive_own_messages: bool = False,
        fd: bool = False,
        **kwargs: object,
    ) -> None:
        self._is_shutdown = True
        if receive_own_messages or fd:
            raise can.CanInitializationError("a ferrodrive bus has no echo of its own frames, and no CAN FD")
        try:
            self.world: World = at_channel(channel)
        except ValueError as error:
            raise can.CanInitializationError(str(error)) from error
        if bitrate is not None and bitrate != self.world.bitrate:
            raise can.CanInitializationError(f"the bus has {self.world.bitrate} bit/s, not {bitrate}")
        #: ``virtual``, or virtual seconds for each second of the clock.
        self.pace = pace
        self._time: Optional[turns.VirtualTime] = None
        self._pace: Optional[Pace] = None
        self._probe = self.world.add_probe()
        try:
            if pace == "virtual":
                self._time = turns.enter(self.world)
            else:
                self._pace = Pace.of(self.world, _speed(pace))
        except BaseException:
            self.world.remove_probe(self._probe)
            raise
        self.channel_info = f"ferrodrive: {self.world!r}"
        self._can_protocol = can.CanProtocol.CAN_20
        self._is_shutdown = False
        super().__init__(channel=channel, can_filters=can_filters)

    def send(self, msg: can.Message, timeout: Optional[float] = None) -> None:
        """Offers a frame to the wire, now. The wire may be busy: it is carried when its turn comes."""
        if self._is_shutdown:
            raise can.CanOperationError("the bus is shut down")
        if msg.is_fd or msg.is_error_frame:
            raise can.CanOperationError("the bus carries data frames and remote frames of classical CAN")
        if self._pace is not None:
            self._pace.catch_up()
        plain = (msg.arbitration_id, msg.is_extended_id, msg.is_remote_frame, msg.dlc, bytes(msg.data))
        try:
            self.world.send(self._probe, plain)
        except (RuntimeError, ValueError) as error:
            raise can.CanOperationError(str(error)) from error

    def _recv_internal(self, timeout: Optional[float]) -> tuple[Optional[can.Message], bool]:
        if self._is_shutdown:
            raise can.CanOperationError("the bus is shut down")
        received = self.world.poll(self._probe)
        if received is None and timeout != 0:
            self._wait(timeout)
            received = None if self._is_shutdown else self.world.poll(self._probe)
        return (None if received is None else self._message(*received)), False

    def _wait(self, timeout_s: Optional[float]) -> None:
        if self._pace is not None:
            self._pace.hear(self._probe, timeout_s)
        elif (time := turns.taking_part(self.world)) is not None:
            until_ns = None if timeout_s is None else time.now_ns() + stand_ins.wait_ns(timeout_s)
            time.hear(self._probe, until_ns)
        else:
            # A thread that takes no part, or the time is over: nothing comes, but nothing spins either.
            Pace.doze(timeout_s)

    def _message(self, at_ns: int, plain: tuple[int, bool, bool, int, bytes]) -> can.Message:
        arbitration_id, is_extended, is_remote, dlc, data = plain
        return can.Message(
            timestamp=(turns.EPOCH_NS + at_ns) / 1e9,
            arbitration_id=arbitration_id,
            is_extended_id=is_extended,
            is_remote_frame=is_remote,
            dlc=dlc,
            data=None if is_remote else bytes(data),
            channel=self.channel_info,
            is_rx=True,
        )

    def shutdown(self) -> None:
        """Takes the adapter off the bus."""
        if self._is_shutdown:
            return
        super().shutdown()
        self.world.remove_probe(self._probe)
        if self._time is not None:
            turns.leave(self._time)


def _speed(pace: Union[str, float]) -> float:
    try:
        return float(pace)
    except (TypeError, ValueError):
        raise ValueError(f"pace is {pace!r}; expected 'virtual', or virtual seconds for each second of the clock, such as 1.0") from None
