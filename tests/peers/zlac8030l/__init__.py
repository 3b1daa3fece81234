"""Checks of the virtual ZLAC8030L. Expected values: its manual, CiA 301, CiA 402, and docs/drives/zlac8030l.md."""
