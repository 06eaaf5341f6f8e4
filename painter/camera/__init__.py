"""The robot's depth camera through librealsense, its clock, and what if it goes.

No Drake; pictures leave as NumPy arrays.
"""
