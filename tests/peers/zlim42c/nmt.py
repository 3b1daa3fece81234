"""NMT states, boot-up and heartbeat."""

from zl import nmt

nmt.COMMON.into("zlim42c")
