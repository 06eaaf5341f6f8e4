"""Simulated CANopen nodes that behave like real ones, including their faults.

Replaces the robot; the master never imports this room.
"""
