"""Checks that hold for both ZL drives, ZLAC8030L and ZLIM42-C: their manuals print the same, or CiA 301 decides."""
