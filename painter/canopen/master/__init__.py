"""The master: clients of drives and I/O, setpoints, what stops the arm.

`arm_bus.py` is the whole. No thread, no clock: it is stepped.
"""
