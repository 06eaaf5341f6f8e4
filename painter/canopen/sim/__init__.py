"""Simulated CANopen nodes that behave like real ones, down to their faults."""
