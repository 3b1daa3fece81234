"""The CiA 402 power states."""

from zl import power

power.COMMON.into("zlac8030l")
