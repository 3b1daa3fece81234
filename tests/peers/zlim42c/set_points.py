"""Set-points and halt in profile position."""

from zl import position

position.COMMON.into("zlim42c")
