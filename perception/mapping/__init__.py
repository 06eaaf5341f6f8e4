"""Mapping: RGB-D frames and arm poses to corrected poses and one surface map.

Keyframes are linked in a pose graph, fused into a surface, and kept in sessions;
`calibration` finds the camera mount. Rooms import in that order.
"""
