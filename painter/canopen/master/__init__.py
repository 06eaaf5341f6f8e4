"""The master: clients of drives and I/O, setpoints, monitors that stop the arm.

`arm_bus.py` is the entry point. It has no thread and no clock: callers step it.
"""
