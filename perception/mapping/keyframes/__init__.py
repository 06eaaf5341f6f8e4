"""Keyframes: the data kept of a frame, and which of it is in memory.

Constraints and optimisation are in `pose_graph`.
"""
