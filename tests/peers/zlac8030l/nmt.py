"""NMT states, boot-up and heartbeat."""

from zl import nmt

nmt.COMMON.into("zlac8030l")
