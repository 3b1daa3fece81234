"""The reference of the package is what its docstrings and stubs have, everything public is in it, and its examples run."""

import asyncio
import difflib
import doctest
import inspect
import os
import pathlib
import re
import shutil
import subprocess
import sys

import ferrodrive
import pytest
import reference

EXAMPLES = reference.ROOT / "examples"
ENTRIES = list(reference.entries())

ARM = """
[[drive]]
model = "m4230e17b50"
node = 1
[[drive]]
model = "m4230e17b50"
node = 2
[[body]]
name = "arm"
kind = "arm"
drives = [1, 2]
[[body.link]]
axis = [0, 1, 0]
mass_kg = 1.5
center_m = [0.15, 0, 0]
[[body.link]]
axis = [0, 1, 0]
offset_m = [0.3, 0, 0]
mass_kg = 1.0
center_m = [0.12, 0, 0]
"""
#: A module with eight inputs (CiA 401), which can write to objects of others by a multiplexed PDO.
SENSOR = """[FileInfo]
FileName=sensor.eds
[DeviceInfo]
VendorName=none
ProductName=sensor
BaudRate_500=1
NrOfRXPDO=0
NrOfTXPDO=1
[MandatoryObjects]
SupportedObjects=3
1=0x1000
2=0x1001
3=0x1018
[OptionalObjects]
SupportedObjects=3
1=0x1800
2=0x1A00
3=0x6000
[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0x00010191
[1001]
ParameterName=Error register
ObjectType=0x7
DataType=0x0005
AccessType=ro
DefaultValue=0
[1018]
ParameterName=Identity object
ObjectType=0x9
SubNumber=2
[1018sub0]
ParameterName=Highest sub-index supported
ObjectType=0x7
DataType=0x0005
AccessType=const
DefaultValue=1
[1018sub1]
ParameterName=Vendor-ID
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0
[1800]
ParameterName=TPDO communication parameter
ObjectType=0x9
SubNumber=3
[1800sub0]
ParameterName=Highest sub-index supported
ObjectType=0x7
DataType=0x0005
AccessType=const
DefaultValue=2
[1800sub1]
ParameterName=COB-ID used by TPDO
ObjectType=0x7
DataType=0x0007
AccessType=rw
DefaultValue=$NODEID+0x180
[1800sub2]
ParameterName=Transmission type
ObjectType=0x7
DataType=0x0005
AccessType=rw
DefaultValue=254
[1A00]
ParameterName=TPDO mapping parameter
ObjectType=0x9
SubNumber=1
[1A00sub0]
ParameterName=Highest sub-index supported
ObjectType=0x7
DataType=0x0005
AccessType=rw
DefaultValue=0xFF
[6000]
ParameterName=Read input 8-bit
ObjectType=0x8
SubNumber=2
[6000sub0]
ParameterName=Highest sub-index supported
ObjectType=0x7
DataType=0x0005
AccessType=const
DefaultValue=1
[6000sub1]
ParameterName=Read input 1h to 8h
ObjectType=0x7
DataType=0x0005
AccessType=ro
DefaultValue=0
"""
#: A profile velocity (CiA 402-2, 6081h).
SLOW = '[values]\n"6081h:00" = 100\n'


class Names(dict):
    """What the examples of methods begin with, made when one of them asks for it."""

    def __init__(self, stack):
        super().__init__(ferrodrive=ferrodrive, asyncio=asyncio)
        self.stack = stack

    def need(self, words):
        if "Network(world" in words:
            self["world"] = self.a_world("cia402", 5, booted=False)
            return
        for name in ("network", "drive", "parameters", "supervisor", "base", "wheel", "joint", "sensor", "arm", "body", "world"):
            # What an example binds itself is not made before: two supervisors of one network get in each other's way.
            if re.search(rf"\b{name}\b", words) and not re.search(rf"\bas {name}\b", words):
                self.get_made(name)
        for name in ("sweep", "sim", "control"):
            if f"{name}." in words or f"{name}(" in words:
                self.get_made(name)

    def get_made(self, name):
        if name not in self:
            self[name] = getattr(self, f"make_{name}")()
        return self[name]

    def closing(self, thing):
        self.stack.append(thing)
        return thing

    @staticmethod
    def a_world(model, node, booted=True):
        world = ferrodrive.World()
        world.add(model, node=node)
        world.add_probe()  # a frame needs a node that acknowledges it
        if booted:
            world.wait_until_booted()
            world.run_for(1)
        return world

    def make_world(self):
        return self.a_world("cia402", 5)

    def make_wheel(self):
        return self.a_world("zlac8030l", 4)[4]

    def make_joint(self):
        return self.a_world("m4230e17b50", 1)[1]

    def make_sensor(self):
        pathlib.Path("sensor.eds").write_text(SENSOR, encoding="utf-8")
        world = ferrodrive.World()
        sensor = world.add(eds="sensor.eds", node=7)
        probe = world.add_probe()
        world.run_for(3)
        # Start remote node (CiA 301, 7.2.8.3.1.1): an operational one sends PDOs.
        world.send(probe, (0x000, False, False, 2, bytes([1, 7])))
        world.run_for(0.1)
        return sensor

    def make_network(self):
        # On the bus before the drive is: one that sends no heartbeat is heard once.
        self["world"] = self.a_world("cia402", 5, booted=False)
        network = self.closing(ferrodrive.Network(self["world"]))
        network.wait_for(5)
        network.sleep(1)
        return network

    def make_drive(self):
        return self.get_made("network").drive(5)

    def make_parameters(self):
        return self.get_made("network").params(5)

    def make_supervisor(self):
        return self.closing(self.get_made("network").supervise())

    def make_base(self):
        network = self.closing(ferrodrive.Network(ferrodrive.World.machine(EXAMPLES / "base.toml")))
        network.boot()
        return self.closing(network.base())

    def make_body(self):
        return ferrodrive.World.machine(EXAMPLES / "base.toml").body("base")

    def make_arm(self):
        pathlib.Path("arm.toml").write_text(ARM, encoding="utf-8")
        return ferrodrive.World.machine("arm.toml").body("arm")

    def make_sweep(self):
        return ferrodrive.Sweep("scenario.toml", range(1, 3))

    def make_sim(self):
        return self.closing(ferrodrive.Simulator(["zlac8030l@4"]).__enter__())

    def make_control(self):
        return self.closing(self.get_made("sim").control())


@pytest.fixture
def names(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(EXAMPLES / "base.toml", "base.toml")
    shutil.copy(EXAMPLES / "scenarios" / "emergency_stop.toml", "scenario.toml")
    pathlib.Path("slow.toml").write_text(SLOW, encoding="utf-8")
    opened = []
    yield Names(opened)
    for thing in reversed(opened):
        thing.quit() if isinstance(thing, ferrodrive.Simulator) else thing.close()


def test_everything_public_is_in_the_reference():
    named = [name for names in reference.SECTIONS.values() for name in names]
    assert sorted(named) == sorted(set(ferrodrive.__all__) - {"__version__"})


@pytest.mark.parametrize("entry", ENTRIES, ids=[entry.name for entry in ENTRIES])
def test_what_is_public_is_described_and_what_is_called_has_an_example(entry):
    assert entry.words.strip(), f"{entry.name} has no docstring"
    refers = entry.words.startswith("As :meth:")
    assert not entry.is_called or refers or ">>>" in entry.words, f"{entry.name} has no example"


CALLED = [entry for entry in ENTRIES if entry.is_called and not entry.signature.startswith("class ")]
#: A unit that ends a name, and one among words; what has none is counted, or is a share.
UNIT_OF_NAME = re.compile(r"_(rpm|deg|rad|m|s|ms|us|ns|hz|a|v|c|nm|n|kg|m2|w|s2|s3|ohm|turns)$")
UNIT_IN_WORDS = re.compile(
    r"\b(s|ms|seconds?|r/min|degrees?|rad|m|mm|Hz|A|V|N|kg|turns?|counts?|share|ratio|times|probability|0 to 1)\b|N·m|°C|%"
)


def words_of(entry):
    """Its own, and those of what it refers to."""
    refers = re.match(r"(?:As )?:meth:`~?(?:ferrodrive\.)?([\w.]+)`", entry.words)
    names = {refers.group(1), f"{entry.name.split('.')[0]}.{refers.group(1)}"} if refers else set()
    named = [other.words for other in ENTRIES if other.name in names]
    return "\n".join([entry.words, *named])


def numbers_of(entry):
    """The parameters that are numbers with fractions."""
    inside = re.search(r"\((.*)\)", entry.signature.split(" -> ")[0])
    parameters = re.split(r", (?![^\[]*\])", inside.group(1)) if inside else []
    parted = [re.match(r"\*{0,2}(\w+): ([^=]+?)(?: = .*)?$", parameter) for parameter in parameters]
    return [part.group(1) for part in parted if part and re.search(r"\b(float|Number)\b", part.group(2))]


def test_a_number_has_its_unit_in_its_name_or_in_words():
    unstated = []
    for entry in CALLED:
        words = words_of(entry)
        for name in numbers_of(entry):
            own = re.search(rf":param {name}: ((?:.|\n)*?)(?=\n *:|\n\n|$)", words)
            beside = words.split(">>>")[0]
            in_words = UNIT_IN_WORDS.search(own.group(1)) if own and "imes in s" not in beside else UNIT_IN_WORDS.search(beside)
            if not UNIT_OF_NAME.search(name) and not in_words:
                unstated.append(f"{entry.name}: {name}")
    assert sum(len(numbers_of(entry)) for entry in CALLED) > 100
    assert not unstated, unstated


def function_of(name):
    """What is called, where it is written in Python."""
    thing = ferrodrive
    for part in name.split("."):
        thing = inspect.getattr_static(thing, part) if inspect.isclass(thing) else getattr(thing, part)
    thing = inspect.unwrap(getattr(thing, "__func__", thing))
    return thing if inspect.isfunction(thing) else None


def test_an_error_that_a_call_raises_by_itself_is_named_in_its_words():
    unnamed, seen = [], 0
    for entry in CALLED:
        function = function_of(entry.name) if entry.name not in reference.STUB else None
        if function is None:
            continue
        body = inspect.getsource(function).split('"""')[-1]
        raised = {kind for kind in re.findall(r"raise (\w+)", body) if kind[0].isupper()}
        seen += len(raised)
        unnamed += [f"{entry.name}: {kind}" for kind in raised if kind not in words_of(entry)]
    assert seen > 10
    assert not unnamed, unnamed


WITH_EXAMPLES = [entry for entry in ENTRIES if ">>>" in entry.words]


@pytest.mark.parametrize("entry", WITH_EXAMPLES, ids=[entry.name for entry in WITH_EXAMPLES])
def test_an_example_of_the_reference_runs(entry, names):
    if entry.name == "sweep_table":
        pytest.importorskip("pyarrow", reason="pyarrow is not installed here")
    names.need(" ".join(line for line in entry.words.splitlines() if line.startswith((">>>", "..."))))
    test = doctest.DocTestParser().get_doctest(entry.words, names, entry.name, None, None)
    said = []
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.IGNORE_EXCEPTION_DETAIL)
    result = runner.run(test, out=said.append, clear_globs=False)
    assert result.attempted > 0 and result.failed == 0, "".join(said)


#: What the examples of methods begin with, by type.
TYPES = {
    "world": "World",
    "network": "Network",
    "drive": "Drive",
    "parameters": "Parameters",
    "supervisor": "Supervisor",
    "base": "Base",
    "wheel": "VirtualDrive",
    "joint": "VirtualDrive",
    "sensor": "VirtualDrive",
    "arm": "Body",
    "body": "Body",
    "sweep": "Sweep",
    "sim": "Simulator",
    "control": "Control",
}


def test_the_examples_hold_what_the_types_promise(tmp_path):
    pytest.importorskip("mypy")
    given = ", ".join(f"{name}: ferrodrive.{kind}" for name, kind in TYPES.items())
    lines = ["import asyncio", "import time", "import ferrodrive"]
    for number, entry in enumerate(WITH_EXAMPLES):
        lines += ["", f"def example_{number}({given}) -> None:  # {entry.name}"]
        for example in doctest.DocTestParser().get_examples(entry.words):
            lines += [f"    {line}" for line in example.source.splitlines()]
    file = tmp_path / "examples.py"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    programs = [path for path in sorted(EXAMPLES.glob("*.py")) if "import ferrodrive" in path.read_text(encoding="utf-8")]
    cache = reference.ROOT / "target" / "mypy"
    for path in (file, *programs):
        words = [sys.executable, "-m", "mypy", "--strict", "--ignore-missing-imports", "--cache-dir", str(cache), str(path)]
        made = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path, timeout=300)
        assert made.returncode == 0, made.stdout + made.stderr


def test_the_page_is_as_the_docstrings_are():
    text = reference.page()
    if os.environ.get("FERRODRIVE_WRITE_PAGES"):
        reference.PAGE.write_text(text, encoding="utf-8")
    there = reference.PAGE.read_text(encoding="utf-8")
    differs = "\n".join(list(difflib.unified_diff(there.splitlines(), text.splitlines(), "docs/python.md", "docstrings", lineterm="", n=0))[:20])
    assert there == text, f"write it anew: {reference.WRITE}\n{differs}"
