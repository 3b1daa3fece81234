"""The reference of the package, `docs/python.md`, made of its docstrings and of the stub of its native half."""

from __future__ import annotations

import ast
import inspect
import pathlib
import re
import textwrap
from collections.abc import Iterator
from typing import ForwardRef, NamedTuple, Optional

import ferrodrive
import ferrodrive.pytest_plugin
import ferrodrive.reports

ROOT = pathlib.Path(__file__).resolve().parents[3]
PAGE = ROOT / "docs" / "python.md"
WRITE = "FERRODRIVE_WRITE_PAGES=1 cargo xtask test --only python"

#: The page's sections, and what of the package is in each.
SECTIONS = {
    "Virtual drives": ["World", "VirtualDrive", "Body", "ExternalShaft", "Worlds", "virtual_time", "models", "eds", "stimulus_forms"],
    "The master": [
        "Network",
        "Drive",
        "AsyncDrive",
        "Axis",
        "Group",
        "AsyncGroup",
        "Base",
        "AsyncBase",
        "Supervisor",
        "AsyncSupervisor",
        "Parameters",
        "AsyncParameters",
        "check",
        "save_capture",
        "load_capture",
        "tune_capture",
    ],
    "Scenarios": ["run", "Outcome", "Row", "Sweep", "SweepSummary", "sweep_table"],
    "A served simulator": ["Simulator", "Control"],
    "What goes wrong": [
        "FerrodriveError",
        "MasterError",
        "NoAnswer",
        "Aborted",
        "NotReached",
        "BadRequest",
        "Refused",
        "SimulatorError",
        "Stalled",
        "TimeInUse",
        "BusWarning",
    ],
}

HEAD = """# The Python package

<!-- Made of the docstrings and stubs in crates/python by `{write}`; change those. -->

What `import ferrodrive` gives, name by name. How a suite is written with it is in
[Test your software](handbook/test-your-software.md); what the dicts have that a network reports is in [What --json prints](json.md) and,
typed, in `ferrodrive.reports`. Quantities have their units in their names, or in the words beside them. Each example is run by the
tests of the package. In the examples of methods `world` is a `World` with a servo (`cia402`) at node 5, `network` a `Network` on it,
`drive` is `network.drive(5)`, and files such as `base.toml` are those of `examples`.

## In pytest

{plugin}"""


class Entry(NamedTuple):
    """Something public: its name with its class, how it is called, and its docstring."""

    name: str
    signature: str
    words: str
    #: It is a class, a function or a method; a property or a field is not.
    is_called: bool


def entries() -> Iterator[Entry]:
    """Everything public, in the order of the page."""
    for names in SECTIONS.values():
        for name in names:
            yield from of_name(name)


def of_name(name: str) -> Iterator[Entry]:
    thing = getattr(ferrodrive, name)
    if not inspect.isclass(thing):
        if name in STUB:
            yield STUB[name]
        else:
            yield Entry(name, f"{name}{signature(thing)}", inspect.getdoc(thing) or "", True)
        return
    made = "" if issubclass(thing, (Exception, Warning)) else signature(thing.__init__ if "__new__" not in vars(thing) else thing.__new__)
    yield Entry(name, f"class {name}{made}".replace(" -> None", "").replace(" -> Self", ""), own_words(thing), True)
    yield from fields(thing)
    seen = set()
    for kind in thing.__mro__:
        if not kind.__module__.startswith("ferrodrive") or kind.__module__ == "ferrodrive._native":
            continue
        for member, value in vars(kind).items():
            if member.startswith("_") or member in seen:
                continue
            seen.add(member)
            if isinstance(value, property):
                yield Entry(f"{name}.{member}", f"{member}: {annotation(value.fget)}", inspect.getdoc(value) or "", False)
            elif inspect.isfunction(value) or isinstance(value, classmethod):
                function = inspect.unwrap(value.__func__ if isinstance(value, classmethod) else value)
                before = "async " if inspect.iscoroutinefunction(function) else ""
                yield Entry(f"{name}.{member}", f"{before}{member}{signature(function)}", inspect.getdoc(function) or "", True)
    yield from (entry for key, entry in STUB.items() if key.startswith(f"{name}.") and name == "World")


def own_words(thing: type) -> str:
    return inspect.cleandoc(thing.__dict__.get("__doc__") or "")


def fields(thing: type) -> Iterator[Entry]:
    """The attributes that a class describes in `#:` lines."""
    source = textwrap.dedent(inspect.getsource(thing))
    pattern = r"((?:^ +#: .*\n)+)^ +(?:self\.)?([a-z_]+)(?:: ([^=\n]+?))?(?: = .*)?$"
    for lines, name, kind in re.findall(pattern, source, re.MULTILINE):
        words = " ".join(line.strip().removeprefix("#: ") for line in lines.splitlines())
        if not name.startswith("_"):
            yield Entry(f"{thing.__name__}.{name}", f"{name}: {kind}" if kind else name, words, False)


def signature(function) -> str:
    """As it is written, whatever the version of Python."""
    parts, star = [], False
    for parameter in inspect.signature(function).parameters.values():
        if parameter.name in ("self", "cls"):
            continue
        text = parameter.name
        if parameter.kind is parameter.KEYWORD_ONLY and not star:
            parts, star = [*parts, "*"], True
        if parameter.kind is parameter.VAR_POSITIONAL:
            text, star = "*" + text, True
        if parameter.kind is parameter.VAR_KEYWORD:
            text = "**" + text
        if parameter.annotation is not parameter.empty:
            text += f": {parameter.annotation}"
        if parameter.default is not parameter.empty:
            text += f" = {parameter.default!r}"
        parts.append(text)
    returns = annotation(function)
    return f"({', '.join(parts)})" + (f" -> {returns}" if returns else "")


def annotation(function) -> str:
    return str(function.__annotations__.get("return", ""))


def stub() -> dict[str, Entry]:
    """What of the native half is for users: what has an example in its stub."""
    tree = ast.parse((pathlib.Path(ferrodrive.__file__).with_name("_native.pyi")).read_text(encoding="utf-8"))
    found = {}
    for node in ast.walk(tree):
        for child in getattr(node, "body", []) if isinstance(node, (ast.Module, ast.ClassDef)) else []:
            words = ast.get_docstring(child) if isinstance(child, ast.FunctionDef) else None
            if not words or ">>>" not in words:
                continue
            name = f"{node.name}.{child.name}" if isinstance(node, ast.ClassDef) else child.name
            returns = ast.unparse(child.returns) if child.returns else ""
            is_property = any(isinstance(mark, ast.Name) and mark.id == "property" for mark in child.decorator_list)
            given = re.sub(r"\bself(, )?", "", ast.unparse(child.args))
            called = f"{child.name}: {returns}" if is_property else f"{child.name}({given}) -> {returns}"
            found[name] = Entry(name, called, words, not is_property)
    return found


STUB: dict[str, Entry] = stub()


def page() -> str:
    """The text of the page."""
    plugin = markdown(inspect.getdoc(ferrodrive.pytest_plugin) or "")
    text = [HEAD.format(write=WRITE, plugin=plugin.split("\n\n", 1)[1].rstrip() + "\n")]
    for section, names in SECTIONS.items():
        text.append(f"\n## {section}\n")
        for name in names:
            for entry in of_name(name):
                text.append(block(entry))
    text += reports()
    return re.sub(r"\n{3,}", "\n\n", "\n".join(text)).rstrip() + "\n"


def reports() -> Iterator[str]:
    """The dicts that a network reports, each with its fields."""
    yield "\n## What is reported\n\nDicts, typed in `ferrodrive.reports`; their fields are those of [`--json`](json.md).\n"
    for name, thing in vars(ferrodrive.reports).items():
        if not name.startswith("_") and isinstance(thing, type) and thing.__module__ == "ferrodrive.reports":
            fields = ", ".join(f"`{field}: {plain(kind)}`" for field, kind in thing.__annotations__.items())
            yield f"\n### {name}\n\n{markdown(own_words(thing))}\n\n{fields}\n"


def plain(kind) -> str:
    return kind.__forward_arg__ if isinstance(kind, ForwardRef) else str(kind)


def block(entry: Entry) -> str:
    is_member = "." in entry.name
    head = f"\n### {entry.name}\n" if not is_member else f"\n#### {entry.name}\n"
    if is_member and not entry.is_called and ">>>" not in entry.words:
        return f"- `{entry.signature}`: {markdown(entry.words).strip()}"
    return f"{head}\n```text\n{entry.signature}\n```\n\n{markdown(entry.words).rstrip()}\n"


def markdown(words: str) -> str:
    """A docstring as Markdown."""
    lines: list[str] = []
    fence: Optional[str] = None
    for line in words.splitlines():
        if fence == ">>>" and not line.strip():
            lines, fence = [*lines, "```"], None
        elif fence == "::" and line.strip() and not line.startswith(" "):
            while lines and not lines[-1].strip():
                lines.pop()
            lines, fence = [*lines, "```", ""], None
        if fence is None and line.startswith(">>>"):
            lines, fence = [*lines, "```pycon"], ">>>"
        if fence is None and line.rstrip().endswith("::"):
            before = line.rstrip()[:-2].rstrip()
            lines, fence = [*lines, *([before + ":", ""] if before else []), "```python"], "::"
            continue
        lines.append(line if fence else prose(line))
    if fence:
        lines.append("```")
    return re.sub(r"```python\n\n+", "```python\n", "\n".join(lines))


def prose(line: str) -> str:
    line = re.sub(r":(?:class|meth|func|attr|mod):`~?(?:ferrodrive\.)?([^`]+)`", r"`\1`", line)
    line = re.sub(r"``([^`]+)``", r"`\1`", line)
    line = re.sub(r"^:param (\w+): ", r"- `\1`: ", line)
    line = re.sub(r"^:raises ([\w.]+): ", r"- raises `\1`: ", line)
    return re.sub(r"^ {4,}", "  ", line)
