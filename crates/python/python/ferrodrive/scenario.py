"""Scenarios and sweeps of them: what ``ferrodrive run`` does."""

from __future__ import annotations

import json
import math
import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Optional, Union

from . import _native
from .words import setting

#: The value of a parameter: a number, or a text as the file would have it.
Value = Union[int, float, str]

#: A line of a file of results is at most so long, in bytes.
LONGEST_LINE = 1 << 20


@dataclass(frozen=True)
class Row:
    """One thing that was asked in a run, and what was seen.

    >>> outcome = ferrodrive.run("scenario.toml")
    >>> outcome.rows[0].verdict
    'passed'
    """

    #: ``step``: what the outer world does; ``host``: what a host does; ``expect``: what is expected.
    kind: str
    #: Its name, or that of its host.
    name: str
    #: What was asked, in the words of the file.
    asked: str
    #: When it was done or decided, in s of virtual time; None if that never came.
    at: Optional[float]
    #: What was seen.
    seen: str
    #: ``passed``, ``failed``, or ``skipped`` for what was not reached because something before it failed.
    verdict: str
    #: Line of the file.
    line: int

    @property
    def passed(self) -> bool:
        """True if it is as asked."""
        return self.verdict == "passed"

    def __str__(self) -> str:
        at = "never" if self.at is None else f"{self.at:.4f} s"
        return f"line {self.line}: {self.kind} {self.asked or self.name}: {self.verdict} ({at}): {self.seen}"


@dataclass(frozen=True)
class Outcome:
    """What came of a scenario. As text it is what failed, and the last frames: ``assert outcome.passed, outcome``.

    >>> outcome = ferrodrive.run("scenario.toml")
    >>> assert outcome.passed, outcome
    """

    title: str
    #: What decided everything random.
    seed: int
    #: The parameters and their values in this run.
    parameters: Mapping[str, str]
    #: Virtual time at the end in s.
    end: float
    #: What was asked and seen, in the order of time; what never came is last.
    rows: Sequence[Row]
    #: The figures that the file names, in its units; not a number where there was nothing to measure.
    figures: Mapping[str, float]
    #: Hash over all frames with their times and over the shaft angles: equal digests, equal runs.
    digest: int
    #: The last frames on the wire of a run that failed, one candump line each.
    last_frames: Sequence[str]

    @property
    def passed(self) -> bool:
        """True if everything is as asked."""
        return all(row.passed for row in self.rows)

    @property
    def expectations(self) -> Sequence[Row]:
        """The rows of what the file expects."""
        return tuple(row for row in self.rows if row.kind == "expect")

    @property
    def failures(self) -> Sequence[Row]:
        """The rows that are not as asked."""
        return tuple(row for row in self.rows if not row.passed)

    def __str__(self) -> str:
        as_asked = len(self.rows) - len(self.failures)
        head = f"{self.title}: {as_asked} of {len(self.rows)} as expected, seed {self.seed}, digest {self.digest:016x}"
        return "\n".join([head, *(f"  {row}" for row in self.failures), *(f"  {frame}" for frame in self.last_frames)])


def run(
    path: Union[str, os.PathLike[str]], seed: Optional[int] = None, set: Optional[Mapping[str, Value]] = None
) -> Outcome:
    """Runs a scenario in virtual time, as ``ferrodrive run`` does; other threads go on meanwhile.

    :param path: a scenario file (``docs/scenarios.md``)
    :param seed: decides everything random; without it the scenario's, its machine's, or 1
    :param set: values of the scenario's parameters, ``{"torque": 1.5}``

    A file that cannot be read raises :class:`OSError`, one that makes no sense :class:`ValueError` with everything that is wrong
    in it. What is not as the file expects raises nothing: it is in the outcome.

    >>> ferrodrive.run("scenario.toml", seed=7).seed
    7
    """
    os.stat(path)
    return outcome(_native.run_scenario(os.fspath(path), seed, settings(set)))


class Sweep:
    """A scenario with many seeds, and with each value of its ``[sweep]``; runs are numbered from 0.

    It makes one run at a time and has no threads: give the numbers to whatever spreads work (``concurrent.futures``, Ray), and
    their results to a :class:`SweepSummary`. A sweep can be pickled; the other side reads the same file.

    :param path: a scenario file
    :param seeds: one seed after the other, as ``range(1, 101)``
    :param set: values of parameters; one that is set here is not swept

    >>> sweep = ferrodrive.Sweep("scenario.toml", range(1, 3))
    >>> len(sweep), sweep.run(0).passed
    (2, True)
    """

    def __init__(
        self, path: Union[str, os.PathLike[str]], seeds: range = range(1, 2), set: Optional[Mapping[str, Value]] = None
    ) -> None:
        if seeds.step != 1 or len(seeds) == 0 or seeds.start < 0:
            raise ValueError(f"{seeds} is not a range of seeds; expected one after the other, as range(1, 101)")
        os.stat(path)
        self._made_of = (os.fspath(path), seeds, set)
        self._native = _native.Sweep(os.fspath(path), seeds.start, seeds.stop - 1, settings(set))

    def __reduce__(self) -> tuple[type[Sweep], tuple[str, range, Optional[Mapping[str, Value]]]]:
        return Sweep, self._made_of

    def __len__(self) -> int:
        return self._native.runs

    def point(self, number: int) -> tuple[int, dict[str, str]]:
        """Seed and values of the run of this number.

        >>> sweep.point(1)[0]
        2
        """
        seed, values = self._native.point(number)
        return seed, dict(values)

    def run(self, number: int) -> Outcome:
        """Makes the run of this number. Values that make no sense together raise :class:`ValueError`.

        >>> sweep.run(1).seed
        2
        """
        return outcome(self._native.run(number))

    def head(self) -> str:
        """First line of a file of results, with its line end: which sweep it is of, and its columns with their Arrow types.

        >>> sweep.head().startswith("{")
        True
        """
        return self._native.head()

    def line(self, number: int) -> str:
        """Makes the run of this number; returns its line in a file of results, with its line end. Behind :meth:`head` and in the
        order of their numbers the lines are what ``ferrodrive run --seeds -o results.jsonl`` writes. Values that make no sense together
        raise nothing: this run has failed.

        >>> import json
        >>> json.loads(sweep.line(1))["seed"]
        2
        """
        return self._native.line(number)

    def summary(self) -> SweepSummary:
        """A summary to which no run has been added.

        >>> sweep.summary().report()["passed"]
        0
        """
        return SweepSummary(self._native)


class SweepSummary:
    """What came of the runs of a sweep, in a size that does not grow with them. The order of adding does not matter.

    >>> summary = sweep.summary()
    >>> summary.add(0, sweep.run(0))
    >>> summary.report()["passed"]
    1
    """

    def __init__(self, sweep: _native.Sweep) -> None:
        self._native = _native.Summary(sweep)

    def add(self, number: int, came: Union[Outcome, ValueError]) -> None:
        """Adds what came of a run, or what it raised: that run has failed.

        >>> summary = sweep.summary()
        >>> summary.add(0, sweep.run(0))
        """
        if isinstance(came, Outcome):
            failures = came.failures
            failure = (failures[0].asked, failures[0].seen) if failures else None
            self._native.add(number, list(came.figures.items()), failure, came.digest)
        else:
            self._native.add(number, [], ("the machine and the scenario", str(came)))

    def add_line(self, line: str) -> None:
        """Adds what came of a run, by its line of :meth:`Sweep.line` or of a file of results. The line of another sweep raises
        :class:`ValueError`.

        >>> summary = sweep.summary()
        >>> summary.add_line(sweep.line(0))
        """
        self._native.add_line(line)

    def report(self) -> dict[str, Any]:
        """What ``ferrodrive run --seeds --json`` prints: ``runs``, ``passed``, ``failed``, ``complete``; of each figure ``min``,
        ``median``, ``max`` and the points with the least and the most; the first failed runs with the command that repeats each;
        ``seeds_differ``, and a ``note`` where the seed makes no difference.

        >>> sweep.summary().report()["complete"]
        False
        """
        report: dict[str, Any] = json.loads(self._native.report())
        return report


def sweep_table(path: Union[str, os.PathLike[str]]) -> Any:
    """The results of a sweep as a table of Arrow, a row for each run; needs the package ``pyarrow``.

    :param path: a file that ``ferrodrive run --seeds -o results.jsonl`` has written

    Columns: ``run`` and ``seed`` (``uint64``), ``values.NAME`` for each parameter that is swept (``double`` where all of its values
    are numbers, else ``string``), ``passed`` (``bool``), ``end_s`` (``double``, virtual time), ``figures.NAME`` (``double``, in the
    units of the scenario), ``digest``, ``asked`` and ``seen`` (``string``). What a run does not have is null: a figure with nothing to
    measure, what failed in a run that passed. A file that is not one of results raises :class:`ValueError`; one
    with fewer runs than its head says warns of that.

    >>> with open("results.jsonl", "w") as file:
    ...     _ = file.write(sweep.head() + sweep.line(0) + sweep.line(1))
    >>> ferrodrive.sweep_table("results.jsonl")["seed"].to_pylist()
    [1, 2]
    """
    import pyarrow  # type: ignore[import-untyped, import-not-found, unused-ignore]
    import pyarrow.json  # type: ignore[import-untyped, import-not-found, unused-ignore]

    with open(path, "rb") as file:
        try:
            head = json.loads(file.readline())
            columns = head["columns"]
            index, count = map(int, head["shard"].split("/"))
            runs = len(range(index - 1, head["runs"], count))
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            wanted = "expected that of what `ferrodrive run --seeds -o NAME.jsonl` writes"
            raise ValueError(f"{os.fspath(path)}, line 1: not the head of a file of results; {wanted}") from error
        lines = file.read()
    # What a process that was killed left of a line is not a result.
    lines = lines[: lines.rfind(b"\n") + 1]
    has = lines.count(b"\n")
    if has < runs:
        warnings.warn(f"{os.fspath(path)} has {has} of its {runs} runs: the sweep has not ended", stacklevel=2)
    kinds = [(name, pyarrow.type_for_alias(kind)) for name, kind in columns]
    if not lines:
        return pyarrow.schema(kinds).empty_table()
    shape: dict[str, Any] = {}
    for name, kind in kinds:
        group, dot, member = name.partition(".")
        if dot:
            shape.setdefault(group, []).append((member, kind))
        else:
            shape[group] = kind
    fields = [(name, pyarrow.struct(kind) if isinstance(kind, list) else kind) for name, kind in shape.items()]
    # Without these types a figure that no run has would be of none, and a seed of 64 bits would not fit.
    parse = pyarrow.json.ParseOptions(explicit_schema=pyarrow.schema(fields), unexpected_field_behavior="ignore")
    read = pyarrow.json.ReadOptions(block_size=max(LONGEST_LINE, min(len(lines), 64 * LONGEST_LINE)))
    table = pyarrow.json.read_json(pyarrow.BufferReader(lines), read_options=read, parse_options=parse)
    return table.flatten().select([name for name, _ in columns])


def outcome(text: str) -> Outcome:
    """What the native half says of a run."""
    said = json.loads(text)
    rows = [
        Row(row["kind"], row["name"], row["asked"], row["t"], row["seen"], row["verdict"], row["line"])
        for row in said["rows"]
    ]
    figures = {name: math.nan if value is None else value for name, value in said["figures"].items()}
    return Outcome(
        title=said["title"],
        seed=said["seed"],
        parameters=said["parameters"],
        end=said["end_s"],
        rows=tuple(rows),
        figures=figures,
        digest=int(said["digest"], 16),
        last_frames=tuple(said["last_frames"]),
    )


def settings(values: Optional[Mapping[str, Value]]) -> list[tuple[str, str]]:
    """Names and values as words of a file."""
    return [(name, setting(name, value)) for name, value in (values or {}).items()]
