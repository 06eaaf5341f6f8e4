"""Simulated CANopen nodes that behave like real ones, down to their faults.

Stands in for the robot; the master does not know this room.
"""
