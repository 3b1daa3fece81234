"""The build backend (PEP 517): maturin's, and the command line in the wheel beside the Python package.

`pip install .` in a clone comes here. The binary is built first, by the same cargo and in the same profile, and put where
maturin takes the scripts of a wheel from.

`FERRODRIVE_PROFILE` names a cargo profile other than `release`: `dev` builds in a tenth of the time, for tests.
`FERRODRIVE_PROGRAM` names a binary that is built already, to be taken instead: tests have one, and a release may have a better one.
"""

import os
import pathlib
import shutil
import subprocess
import sys

import maturin

ROOT = pathlib.Path(__file__).resolve().parents[3]
SCRIPTS = ROOT / "crates" / "python" / "ferrodrive.data" / "scripts"
PROGRAM = "ferrodrive.exe" if sys.platform == "win32" else "ferrodrive"

get_requires_for_build_wheel = maturin.get_requires_for_build_wheel
get_requires_for_build_sdist = maturin.get_requires_for_build_sdist
get_requires_for_build_editable = maturin.get_requires_for_build_editable


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    return maturin.prepare_metadata_for_build_wheel(metadata_directory, config_settings)


def prepare_metadata_for_build_editable(metadata_directory, config_settings=None):
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    return maturin.prepare_metadata_for_build_editable(metadata_directory, config_settings)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    profile = prepare()
    return maturin.build_wheel(wheel_directory, with_profile(config_settings, profile), metadata_directory)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    profile = prepare()
    return maturin.build_editable(wheel_directory, with_profile(config_settings, profile), metadata_directory)


def build_sdist(sdist_directory, config_settings=None):
    raise RuntimeError("there is no source distribution: the package is built from a clone, with `pip install .`")


def prepare():
    """Builds the command line and puts it among the scripts. Returns the cargo profile."""
    profile = os.environ.get("FERRODRIVE_PROFILE", "release")
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    # Both builds share what they can: the crates below the Python module are the same.
    os.environ["CARGO_TARGET_DIR"] = str(target)
    # The module is a workspace of its own; it takes the versions of the project's, and has no others to keep.
    shutil.copyfile(ROOT / "Cargo.lock", ROOT / "crates" / "python" / "Cargo.lock")
    built = os.environ.get("FERRODRIVE_PROGRAM")
    if built is None:
        command = ["cargo", "build", "--locked", "--profile", profile, "--package", "ferrodrive", "--bin", "ferrodrive"]
        subprocess.run(command, cwd=ROOT, check=True)
        built = target / ("debug" if profile == "dev" else profile) / PROGRAM
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    shutil.copy2(built, SCRIPTS / PROGRAM)
    if profile == "dev":
        strip(SCRIPTS / PROGRAM)
    return profile


def strip(program):
    """Takes the debug information out, where there is a tool for it: a wheel is no place for it."""
    if tool := shutil.which("strip"):
        subprocess.run([tool, str(program)], check=False)


def with_profile(config_settings, profile):
    """The settings with `--profile` in maturin's words, unless the caller gave arguments of his own."""
    settings = dict(config_settings or {})
    settings.setdefault("build-args", f"--profile {profile}")
    return settings
