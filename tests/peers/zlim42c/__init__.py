"""Checks of the virtual ZLIM42-C. Expected values: its manual, CiA 301, CiA 402, and docs/drives/zlim42c.md."""

from canopen.profiles.p402 import BaseNode402

from drive import Drive


class Node(BaseNode402):
    """The drive has no 6502h (supported modes), which the library insists on. Modes 1, 3, 6 by the manual."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self._op_mode_support = 1 << 0 | 1 << 2 | 1 << 5


DRIVE = Drive(
    "zlim42c", model="zlim42c", node_id=1, device_type=0x00040192, node_class=Node, per_rpm=1
)
rows = DRIVE.rows
