"""Diagrams alone: the station with its two bodies, the brain, the paint cycle.

`station.py` is the contract of both bodies. Running a diagram is `painter.cycle`.
"""
