"""Keyframes: what is kept of a frame, and which of them are in memory.

No links and no optimisation; those are in `pose_graph`.
"""
