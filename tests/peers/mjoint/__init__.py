"""Checks of the virtual M joints. Expected values: their manual, CiA 301, CiA 402, and docs/drives/mjoint.md."""

from canopen import RemoteNode

from drive import Drive

DRIVE = Drive(
    "mjoint", model="m4230e17b50", node_id=1, device_type=0x00020192, node_class=RemoteNode, per_rpm=10
)
rows = DRIVE.rows
