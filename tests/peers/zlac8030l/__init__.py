"""Checks of the virtual ZLAC8030L. Expected values: its manual, CiA 301, CiA 402, and docs/drives/zlac8030l.md."""

from canopen.profiles.p402 import BaseNode402

from drive import Drive


class Node(BaseNode402):
    """The drive has no 6502h (supported modes), which the library insists on. Modes 1, 3, 4 by the manual."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self._op_mode_support = 1 << 0 | 1 << 2 | 1 << 3


DRIVE = Drive(
    "zlac8030l", model="zlac8030l", node_id=4, device_type=0x00040192, node_class=Node, per_rpm=10
)
rows = DRIVE.rows
