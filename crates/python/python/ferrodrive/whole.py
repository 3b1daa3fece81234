"""What is asked of a network as a whole, blocking and as coroutines: who is there, its boot-up, its description, its load, why a
drive does not move, and the report about a node."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from datetime import datetime, timezone
from typing import Any, Optional, Union, cast

from . import _native
from ._native import Job
from ._native import Network as NativeNetwork
from .parameters import File
from .reports import BootReport, CheckReport, ExplainReport, NodeReport, PlanReport, ScanReport, Tuning
from .supervisor import path_of


class Whole:
    """The part of a :class:`~ferrodrive.Network` that is about all its nodes."""

    _native: NativeNetwork
    _machine: Optional[str]
    #: The bus as it was named.
    _bus: str

    def _finish(self, job: Job) -> Any:
        raise NotImplementedError

    async def _finish_soon(self, job: Job, keep: bool = False) -> Any:
        raise NotImplementedError

    def scan(self) -> ScanReport:
        """Asks all 127 node-IDs who they are; reads only. A node that boots meanwhile is asked once it has; what others sent meanwhile is in
        ``heard``.

        :raises MasterError: no node is on the bus (kind ``no_node``)

        >>> [(node["node"], node["model"]) for node in network.scan()["nodes"]]
        [(5, 'cia402')]
        """
        return cast(ScanReport, self._finish(self._scan()))

    async def async_scan(self) -> ScanReport:
        """As :meth:`scan`."""
        return cast(ScanReport, await self._finish_soon(self._scan()))

    def _scan(self) -> Job:
        return _native.scan(self._native)

    def boot(
        self,
        file: Optional[File] = None,
        *,
        nodes: Sequence[int] = (),
        reset: bool = False,
        start: bool = True,
    ) -> BootReport:
        """Boots the nodes by CiA 302-2: who they are is checked, they are configured and started; no motor is moved. What is expected is in
        a machine file or the DCF of a CANopen manager, else in the network's machine file, else each node is booted as what it is.

        :param nodes: these alone
        :param reset: nodes that are operational too: a motor that turns may stop at once, or go on
        :param start: False leaves them pre-operational
        :raises MasterError: a mandatory node has failed (kind ``not_booted``), or one that was left as it is does not have what the file
            says (``not_configured``); ``report`` of the exception has each step

        >>> [step["step"] for step in network.boot()["nodes"][0]["steps"]][-1]
        'start'
        """
        return cast(BootReport, self._finish(self._boot(file, nodes, reset, start)))

    async def async_boot(
        self,
        file: Optional[File] = None,
        *,
        nodes: Sequence[int] = (),
        reset: bool = False,
        start: bool = True,
    ) -> BootReport:
        """As :meth:`boot`."""
        return cast(BootReport, await self._finish_soon(self._boot(file, nodes, reset, start)))

    def _boot(self, file: Optional[File], nodes: Sequence[int], reset: bool, start: bool) -> Job:
        return _native.boot(self._native, path_of(file), list(nodes), reset, start)

    def check(self, file: Optional[File] = None, *, strict: bool = False) -> CheckReport:
        """Checks the description of a bus as :func:`~ferrodrive.check` does, and holds it against the drives of this one; reads only.

        :param file: a machine file, or a ``bus.yml`` of ros2_canopen; without it the network's machine file
        :param strict: ``ok`` is False for warnings too
        :raises MasterError: the file makes no sense
        :raises ValueError: no file was given, and the network has none

        >>> network.check("base.toml")["errors"] > 0        # node 4 of the file is not on this bus
        True
        """
        return cast(CheckReport, self._finish(self._check(file, strict)))

    async def async_check(self, file: Optional[File] = None, *, strict: bool = False) -> CheckReport:
        """As :meth:`check`."""
        return cast(CheckReport, await self._finish_soon(self._check(file, strict)))

    def _check(self, file: Optional[File], strict: bool) -> Job:
        path = path_of(file) or self._machine
        if path is None:
            raise ValueError("which file? This network has no machine file: check(FILE), or Network(bus, machine=FILE)")
        return _native.check(self._native, path, strict)

    def plan(
        self,
        *,
        cycle: Optional[float] = None,
        mode: Optional[str] = None,
        modes: Optional[Mapping[int, str]] = None,
        bitrate: Optional[Union[int, str]] = None,
        jitter: float = 0.0,
        sdo: float = 0.01,
        emcy: float = 0.1,
        heartbeat: float = 0.0,
        errors: float = 0.0,
        by_priority: bool = False,
    ) -> PlanReport:
        """Whether everything fits the bus: its load, the longest time of each frame, and how many such drives it carries. The group or the base
        of the machine file is planned as it will run. That it does not fit is in the report, and raises nothing. All times in s.

        :param cycle: period of SYNC; without it that of the file's group or base, or 0.01
        :param mode: the PDOs that this mode of operation needs, in place of those that are mapped; ``modes`` the same for single nodes
        :param bitrate: that of the bus; without it the world's or the file's
        :param jitter: how late this program may be with SYNC and RPDOs
        :param sdo: shortest time between two SDO requests; 0 for none
        :param emcy: shortest time between two EMCY of one node; 0 for none
        :param heartbeat: period of this program's heartbeat; 0 for none
        :param errors: the bus destroys a frame at most once in this time; 0 for never
        :param by_priority: the controller sends the most urgent frame first, not in the order given
        :raises MasterError: a node cannot be moved in this mode, or does not answer
        :raises ValueError: the bit rate is not known, or a value makes no sense

        >>> network.plan(cycle=0.005, mode="csp")["fits"]
        True
        """
        times = {"jitter": jitter, "sdo": sdo, "emcy": emcy, "heartbeat": heartbeat, "errors": errors}
        return cast(PlanReport, self._finish(self._plan(cycle, mode, modes, bitrate, times, by_priority)))

    async def async_plan(
        self,
        *,
        cycle: Optional[float] = None,
        mode: Optional[str] = None,
        modes: Optional[Mapping[int, str]] = None,
        bitrate: Optional[Union[int, str]] = None,
        jitter: float = 0.0,
        sdo: float = 0.01,
        emcy: float = 0.1,
        heartbeat: float = 0.0,
        errors: float = 0.0,
        by_priority: bool = False,
    ) -> PlanReport:
        """As :meth:`plan`."""
        times = {"jitter": jitter, "sdo": sdo, "emcy": emcy, "heartbeat": heartbeat, "errors": errors}
        return cast(PlanReport, await self._finish_soon(self._plan(cycle, mode, modes, bitrate, times, by_priority)))

    def _plan(
        self,
        cycle: Optional[float],
        mode: Optional[str],
        modes: Optional[Mapping[int, str]],
        bitrate: Optional[Union[int, str]],
        times: dict[str, float],
        by_priority: bool,
    ) -> Job:
        order = {"cycle": cycle, "mode": mode, "modes": dict(modes or {}), **times, "by_priority": by_priority}
        return _native.plan(self._native, {**order, "bitrate": None if bitrate is None else str(bitrate)})

    def explain(self, node: int, model: Optional[str] = None, *, watch: float = 1.5) -> ExplainReport:
        """Why a drive does not move, and why its PDOs are silent. Listens to the bus first, then reads what the drive has; writes nothing.

        :param model: as for :meth:`drive`
        :param watch: how long to listen, in s: longer than the longest period of what is looked for
        :raises MasterError: the node answers, and refuses what has to be read

        >>> network.explain(5)["findings"][0]["rule"]
        'not_enabled'
        """
        return cast(ExplainReport, self._finish(self._explain(node, model, watch)))

    async def async_explain(self, node: int, model: Optional[str] = None, *, watch: float = 1.5) -> ExplainReport:
        """As :meth:`explain`."""
        return cast(ExplainReport, await self._finish_soon(self._explain(node, model, watch)))

    def _explain(self, node: int, model: Optional[str], watch: float) -> Job:
        return _native.explain(self._native, node, model, watch)

    def report(
        self,
        node: int,
        path: File,
        model: Optional[str] = None,
        *,
        by: Optional[str] = None,
        captures: Sequence[File] = (),
        tunings: Sequence[Tuning] = (),
        force: bool = False,
    ) -> NodeReport:
        """Writes a page about a node that prints well: identity, what differs from delivery, limits, guard, faults, PDOs, captures. What
        ``ferrodrive report`` does. Reads only.

        :param path: the page, ``NAME.html``
        :param model: as for :meth:`drive`
        :param by: who makes it
        :param captures: records (MCAP, CSV) whose curves and figures of this node belong to it
        :param tunings: what :meth:`Drive.tune` of this node has returned: gains and margins, before and after
        :param force: overwrite an existing file
        :raises FileExistsError: the file is there, without ``force``
        :raises MasterError: the node is silent, or its model is not known; a record is not one of this node

        >>> network.report(5, "sheet.html", force=True)["fault"] is None
        True
        """
        page = _new_page(path, force)
        return _kept(page, force, self._finish(self._report(node, model, by, captures, tunings)))

    async def async_report(
        self,
        node: int,
        path: File,
        model: Optional[str] = None,
        *,
        by: Optional[str] = None,
        captures: Sequence[File] = (),
        tunings: Sequence[Tuning] = (),
        force: bool = False,
    ) -> NodeReport:
        """As :meth:`report`."""
        page = _new_page(path, force)
        return _kept(page, force, await self._finish_soon(self._report(node, model, by, captures, tunings)))

    def _report(
        self, node: int, model: Optional[str], by: Optional[str], captures: Sequence[File], tunings: Sequence[Tuning]
    ) -> Job:
        at = datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M UTC")
        files, texts = [os.fspath(path) for path in captures], [json.dumps(tuning) for tuning in tunings]
        return _native.report(self._native, node, model, (at, by, self._bus), files, texts)


def _new_page(path: File, force: bool) -> str:
    """A file for a page, looked at before anything is read on the bus."""
    name = os.fspath(path)
    if not name.lower().endswith(".html"):
        raise ValueError(f"expected a path that ends in .html, got {name!r}")
    if not force and os.path.exists(name):
        raise FileExistsError(f"{name} exists; force=True overwrites it")
    return name


def _kept(path: str, force: bool, read: tuple[NodeReport, str]) -> NodeReport:
    report, page = read
    with open(path, "w" if force else "x", encoding="utf-8", newline="\n") as kept:
        kept.write(page)
    return report
