"""Motions of the camera: first look, zig-zag scan, more looks, and the way home.

The top of planning beside `program`.
"""
