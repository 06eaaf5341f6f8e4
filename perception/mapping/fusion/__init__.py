"""Fusion of depth pictures into one surface.

Takes poses as given; `pose_graph` corrects them.
"""
