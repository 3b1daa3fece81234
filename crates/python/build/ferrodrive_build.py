"""The build backend (PEP 517): maturin's, with cargo's profile chosen here.

`pip install .` in a clone builds the Python module alone, in the profile of the tests (`dev`: what computes is optimised, the rest is
not); docs/performance.md has how long that takes. The command line is one that is there: `cargo install --path crates/cli`, or that of a release,
whose wheel has it.

`FERRODRIVE_PROFILE` names another profile of cargo: `release`, or `dist` for what is released.
`FERRODRIVE_PROGRAM` names a built command line that goes into the wheel.
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
    """Puts the command line among the scripts of the wheel, if one is named. Returns the cargo profile."""
    profile = os.environ.get("FERRODRIVE_PROFILE", "dev")
    os.environ.setdefault("CARGO_TARGET_DIR", str(ROOT / "target"))
    shutil.rmtree(SCRIPTS, ignore_errors=True)
    SCRIPTS.mkdir(parents=True)
    if built := os.environ.get("FERRODRIVE_PROGRAM"):
        shutil.copy2(built, SCRIPTS / PROGRAM)
        if profile == "dev":
            strip(SCRIPTS / PROGRAM)
    return profile


def strip(program):
    """Takes the debug information out, where there is a tool for it: it does not belong in a wheel."""
    if tool := shutil.which("strip"):
        subprocess.run([tool, str(program)], check=False)


def with_profile(config_settings, profile):
    """The settings with profile and lock file in maturin's words, unless the caller gave arguments of his own."""
    settings = dict(config_settings or {})
    settings.setdefault("build-args", f"--profile {profile} --locked")
    return settings
