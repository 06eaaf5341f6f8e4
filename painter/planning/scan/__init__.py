"""Motions of the camera: first look, zig-zag scan, more looks, and the way home.

With `program` the top of planning; neither imports the other.
"""
