"""The CiA 402 power states."""

from zl import power

power.COMMON.into("zlim42c")
