"""Checks of a servo that is made from an EDS. Expected values: CiA 301, CiA 402-2, and the file itself.

The file is the EDS that the program writes of its own `cia402`.
"""

import pathlib
import subprocess
import tempfile

from canopen.profiles.p402 import BaseNode402

from drive import Drive

#: Encoder increments in a turn, which are the position units as delivered.
TURN = 131_072


class FileDrive(Drive):
    """A servo that is made from an EDS, and its node from the same file."""

    def arguments(self, program):
        self.folder_of_file = tempfile.TemporaryDirectory()
        self.path = pathlib.Path(self.folder_of_file.name) / "servo.eds"
        written = subprocess.run([program, "eds", self.model], check=True, capture_output=True, text=True, timeout=60)
        self.path.write_text(written.stdout, encoding="ascii")
        return (f"{self.path}@{self.node_id}",)

    def node(self, node_id):
        return BaseNode402(node_id, str(self.path))


DRIVE = FileDrive("cia402", model="cia402", node_id=5, device_type=0x00020192, per_rpm=TURN / 60)
