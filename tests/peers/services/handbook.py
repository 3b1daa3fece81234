"""The handbook's Python program, as it is printed."""

import handbook_drive
from checks import check
from drive import ZLAC8030L


@check("the handbook's test sees a fault that the machine was given", ZLAC8030L)
def program(bench):
    handbook_drive.PROGRAM = bench.simulator.command_line[0]
    handbook_drive.test_a_fault_is_seen()
