"""Checks of the EDS that `ferrodrive eds MODEL` writes: other people's readers of such files take it without a word, and
what it says is what the drive answers."""

import fcntl
import json
import logging
import pathlib
import subprocess
import tempfile
import venv

import canopen
from canopen.objectdictionary import ODVariable
from canopen.objectdictionary.datatypes import NUMBER_TYPES

from checks import Skip, check, equal, true
from cia402 import DRIVE as CIA402
from drive import ALL

#: Lely's generator of concise DCFs, in an environment of its own: it wants other versions of things than the rest.
DCF_TOOLS = "dcf-tools==2.4.2"
VARIANTS = ((), ("--variant", "ros2_canopen"))
#: The standard's own servo has a sheet like any other model.
MODELS = (*ALL, CIA402)


def write(bench, folder, *options, model=None):
    """Writes the EDS of the bench's model, or of another, into a folder."""
    model = model or bench.drive.model
    command = [bench.program, "eds", model, *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    equal(done.returncode, 0, f"{' '.join(map(str, command[1:]))}: {done.stderr}")
    path = pathlib.Path(folder) / f"{model}.eds"
    path.write_text(done.stdout, encoding="ascii")
    return path


class Said(logging.Handler):
    """What libraries log."""

    def __init__(self):
        super().__init__(logging.WARNING)
        self.lines = []

    def emit(self, record):
        self.lines.append(record.getMessage())


def load(path, node_id):
    """Loads a file with canopen-python, which must have nothing to say."""
    said, root = Said(), logging.getLogger()
    before = root.manager.disable
    logging.disable(logging.NOTSET)
    root.addHandler(said)
    try:
        dictionary = canopen.import_od(str(path), node_id)
    finally:
        root.removeHandler(said)
        logging.disable(before)
    equal(said.lines, [], "what canopen-python says of the file")
    return dictionary


def variables(dictionary):
    for item in dictionary.values():
        yield from [item] if isinstance(item, ODVariable) else item.values()


@check("its EDS loads in canopen-python without a warning", *MODELS)
def loads(bench):
    with tempfile.TemporaryDirectory() as folder:
        for options in VARIANTS:
            dictionary = load(write(bench, folder, *options), bench.drive.node_id)
            rows = bench.drive.rows("objects.csv")
            places = {(row.index, row.subindex) for row in variables(dictionary)}
            missing = {(int(row["index"], 16), int(row["sub"], 16)) for row in rows} - places
            equal(missing, set(), "objects of the manual that the file does not have")


@check("each default of its EDS is what the drive answers when it is fresh", *MODELS)
def defaults(bench):
    with tempfile.TemporaryDirectory() as folder:
        dictionary = load(write(bench, folder), bench.drive.node_id)
    compared, wrong = 0, []
    for row in variables(dictionary):
        if row.default is None or not row.readable:
            continue
        compared += 1
        data = bench.sdo.upload(row.index, row.subindex)
        # A text is as long as it is.
        answered = row.decode_raw(data[: len(row) // 8] if row.data_type in NUMBER_TYPES else data)
        if answered != row.default:
            wrong.append(f"{row.index:04X}h:{row.subindex:02X} is {answered}, in the file {row.default}")
    equal(wrong, [], "defaults")
    true(compared > 50, f"{compared} defaults were compared")


def dcfgen():
    """The program, installed now if need be."""
    folder = pathlib.Path(__file__).resolve().parent.parent.parent / "target" / "dcf-tools-venv"
    folder.parent.mkdir(exist_ok=True)
    program, stamp = folder / "bin" / "dcfgen", folder / "installed.txt"
    with open(folder.with_suffix(".lock"), "w", encoding="ascii") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if stamp.exists() and stamp.read_text(encoding="ascii") == DCF_TOOLS:
            return program
        venv.create(folder, clear=True, with_pip=True)
        pip = [folder / "bin" / "python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        pip += ["--retries", "1", "--timeout", "20", DCF_TOOLS]
        done = subprocess.run(pip, capture_output=True, text=True, timeout=300, check=False)
        if done.returncode != 0:
            raise Skip(f"pip could not install {DCF_TOOLS} (no network?): {done.stderr.strip().splitlines()[-1:]}")
        stamp.write_text(DCF_TOOLS, encoding="ascii")
    return program


@check("Lely's dcfgen takes its EDS and makes a concise DCF of it", *MODELS)
def generates(bench):
    program = dcfgen()
    node_id = bench.drive.node_id
    for options in VARIANTS:
        with tempfile.TemporaryDirectory() as folder:
            path = write(bench, folder, *options)
            bus = pathlib.Path(folder) / "bus.yml"
            bus.write_text(
                "master:\n  node_id: 127\n"
                f"drive:\n  dcf: {path.name}\n  node_id: {node_id}\n  heartbeat_producer: 200\n",
                encoding="ascii",
            )
            command = [program, "-d", folder, bus]
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False)
            equal((done.returncode, done.stderr.strip()), (0, ""), f"dcfgen {options}")
            made = sorted(file.name for file in pathlib.Path(folder).iterdir())
            true("master.dcf" in made and "drive.bin" in made, f"dcfgen made {made}")
            concise = (pathlib.Path(folder) / "drive.bin").read_bytes()
            true(int.from_bytes(concise[:4], "little") >= 1, "the concise DCF writes something")
            true(b"\x17\x10" in concise, "1017h is in the concise DCF")
            (pathlib.Path(folder) / "none.bin").write_bytes(bytes(4))
            command = [bench.program, "params", "diff", "drive.bin", "none.bin", "--json"]
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60, check=False)
            equal(done.returncode, 0, f"our reading of it: {done.stdout}{done.stderr}")
            values = {row["object"]: row["first"]["bytes"] for row in json.loads(done.stdout)["differences"]}
            equal(values.get("1017h:00"), "C8 00", "the heartbeat of 200 ms that was asked for")
