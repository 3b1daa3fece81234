"""A node's configuration as one thing: kept in a file, compared, written all or not at all, checked. What ``ferrodrive params`` does."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Optional, Union, cast

from . import _native
from .reports import ApplyReport, BackupReport, DiffReport, ParametersPlan, RollbackReport, VerifyReport

if TYPE_CHECKING:
    from .master import Network

File = Union[str, "os.PathLike[str]"]


class _Jobs:
    """What can be asked of a node's parameters, as jobs. Both kinds of parameters wait for these."""

    def __init__(self, network: Network, node: int, model: Optional[str]) -> None:
        self.network = network
        #: Its node-ID, 1 to 127.
        self.node = node
        self._of = (network._native, node, model)

    def _backup(self, file: Optional[File], force: bool) -> _native.Job:
        path = _path(file)
        if path is not None and not force and os.path.exists(path):
            raise FileExistsError(f"{path} is there already; nothing was read. Name another file, or give force=True")
        return _native.params_backup(*self._of, path)

    def _kept(self, read: tuple[BackupReport, bytes], file: Optional[File], force: bool) -> BackupReport:
        report, content = read
        if file is not None:
            with open(file, "wb" if force else "xb") as kept:
                kept.write(content)
        return report

    def _compare(self, file: Optional[File], question: str) -> _native.Job:
        return _native.params_compare(*self._of, _path(file), question)

    def _diff(self, other: Union[File, int, None]) -> _native.Job:
        if isinstance(other, int):
            return _native.params_compare_nodes(*self._of, other)
        return self._compare(other, "diff")

    def _plan(self, file: Optional[File], address: bool) -> _native.Job:
        return self._compare(file, "plan with address" if address else "plan")

    def _apply(self, file: Optional[File], journal: Optional[File], **order: Any) -> _native.Job:
        return _native.params_apply(*self._of, _path(file), {**order, "journal": _path(journal)})

    def _rollback(self, journal: Optional[File]) -> _native.Job:
        return _native.params_rollback(*self._of, _path(journal))


class Parameters(_Jobs):
    """The parameters of a node. From :meth:`Network.params`.

    A file is ``.toml`` (objects by number or name, values with units), ``.dcf`` (CiA 306) or ``.bin`` (concise DCF, CiA 302-3). Commands and
    set-points are never among the parameters, and nothing here moves a drive. Without a file what the machine file has for the node is
    meant: its ``pdos``, ``limits``, ``heartbeat`` and ``start_up``.

    >>> parameters = network.params(5)
    >>> parameters.backup("servo.toml")["file"]
    'servo.toml'
    >>> parameters.verify("servo.toml")["ok"]
    True
    """

    def backup(self, file: Optional[File] = None, *, force: bool = False) -> BackupReport:
        """Reads all parameters of its model into a file, or without one into the ``parameters`` of the report, as TOML.

        :param force: write over a file that is there
        :raises FileExistsError: the file is there, and ``force`` was not given
        :raises MasterError: its model is not known, or it does not answer

        >>> parameters.backup()["parameters"].splitlines()[0][:1]
        '#'
        """
        return self._kept(self.network._finish(self._backup(file, force)), file, force)

    def diff(self, other: Union[File, int, None] = None) -> DiffReport:
        """In what the node and a file, or another node, differ; ``first`` is the node, ``second`` the other.

        :param other: a file, or a node-ID, 1 to 127. Of two nodes, what depends on the node-ID is compared as the first one's, and node-ID
            and bit rate are left out
        :raises MasterError: the file cannot be read as parameters, a node does not answer, or the other one's model is not known

        >>> parameters.diff("slow.toml")["differences"][0]["object"]
        '6081h:00'
        >>> parameters.diff(5)["differences"]
        []
        """
        return cast(DiffReport, self.network._finish(self._diff(other)))

    def plan(self, file: Optional[File] = None, *, address: bool = False) -> ParametersPlan:
        """What :meth:`apply` would write, in its order; nothing is written.

        :param address: node-ID and bit rate too, as the last
        :raises MasterError: the node is another device, or cannot have one of the values (kinds ``other_device``, ``unfit_parameters``)

        >>> [step["object"] for step in parameters.plan("slow.toml")["steps"]]
        ['6081h:00']
        """
        return cast(ParametersPlan, self.network._finish(self._plan(file, address)))

    def apply(
        self,
        file: Optional[File] = None,
        *,
        save: bool = False,
        prove: Optional[str] = None,
        within: float = 120.0,
        address: bool = False,
        journal: Optional[File] = None,
    ) -> ApplyReport:
        """Writes a file's parameters to the node, all or none: everything that can be checked is checked before the first write, each value
        is read back, and after a refusal what was written is put back in reverse order. On a real bus a journal is kept meanwhile, by
        which :meth:`rollback` goes back after a power failure.

        :param save: store them in the drive afterwards
        :param prove: start the drive anew afterwards and read everything once more: ``reset`` (NMT), or ``power-cycle``, which waits until
            its supply was switched off and on; needs ``save``
        :param within: longest wait for the drive to come back, in s
        :param address: node-ID and bit rate too, as the last
        :param journal: where the journal is kept; without it ``ferrodrive-nodeN.journal`` in the current folder
        :raises MasterError: refused before anything was written (``other_device``, ``at_work``, ``unfit_parameters``), rolled back
            (``rolled_back``), or not all of it (``not_put_back``)
        :raises ValueError: ``prove`` is not one of these

        >>> parameters.apply("slow.toml")["writes"]
        1
        """
        job = self._apply(file, journal, address=address, save=save, prove=prove, within=within)
        return cast(ApplyReport, self.network._finish(job))

    def verify(self, file: Optional[File] = None) -> VerifyReport:
        """Whether the node has a file's parameters. That it has not is in the report, and raises nothing.

        :raises MasterError: the node is another device, or does not answer

        >>> parameters.verify("slow.toml")["deviations"][0]["wanted"]["text"]
        '100 inc/s'
        """
        return cast(VerifyReport, self.network._finish(self._compare(file, "verify")))

    def rollback(self, journal: Optional[File] = None) -> RollbackReport:
        """Goes back to how the node was before an :meth:`apply` that was broken off, and deletes the journal.

        :param journal: without it ``ferrodrive-nodeN.journal`` in the current folder
        :raises MasterError: there is no journal (``no_journal``), it is of another node, or not everything could be put back

        >>> try:
        ...     parameters.rollback()
        ... except ferrodrive.MasterError as error:
        ...     error.kind
        'no_journal'
        """
        return cast(RollbackReport, self.network._finish(self._rollback(journal)))


class AsyncParameters(_Jobs):
    """:class:`Parameters` with coroutines, for several nodes at the same time. From :meth:`Network.async_params`.

    >>> with ferrodrive.virtual_time(world):
    ...     asyncio.run(network.async_params(5).backup())["values"] > 10
    True
    """

    async def backup(self, file: Optional[File] = None, *, force: bool = False) -> BackupReport:
        """As :meth:`Parameters.backup`."""
        return self._kept(await self.network._finish_soon(self._backup(file, force)), file, force)

    async def diff(self, other: Union[File, int, None] = None) -> DiffReport:
        """As :meth:`Parameters.diff`."""
        return cast(DiffReport, await self.network._finish_soon(self._diff(other)))

    async def plan(self, file: Optional[File] = None, *, address: bool = False) -> ParametersPlan:
        """As :meth:`Parameters.plan`."""
        return cast(ParametersPlan, await self.network._finish_soon(self._plan(file, address)))

    async def apply(
        self,
        file: Optional[File] = None,
        *,
        save: bool = False,
        prove: Optional[str] = None,
        within: float = 120.0,
        address: bool = False,
        journal: Optional[File] = None,
    ) -> ApplyReport:
        """As :meth:`Parameters.apply`."""
        job = self._apply(file, journal, address=address, save=save, prove=prove, within=within)
        return cast(ApplyReport, await self.network._finish_soon(job))

    async def verify(self, file: Optional[File] = None) -> VerifyReport:
        """As :meth:`Parameters.verify`."""
        return cast(VerifyReport, await self.network._finish_soon(self._compare(file, "verify")))

    async def rollback(self, journal: Optional[File] = None) -> RollbackReport:
        """As :meth:`Parameters.rollback`."""
        return cast(RollbackReport, await self.network._finish_soon(self._rollback(journal)))


def _path(file: Optional[File]) -> Optional[str]:
    return None if file is None else os.fspath(file)
