"""Mapping: RGB-D frames and arm poses to corrected poses and one surface map.

`keyframes` holds the data kept of a frame, `pose_graph` corrects poses, `fusion` makes
the surface, `sessions` runs them, and `calibration` finds the camera mount. Rooms
import in that order.
"""
