"""The real depth camera through librealsense: driver, clock, reconnection.

No Drake; pictures leave as NumPy arrays.
"""
