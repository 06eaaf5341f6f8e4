"""Fusion of depth pictures into one surface.

Takes poses as given; who corrects them is `pose_graph`.
"""
