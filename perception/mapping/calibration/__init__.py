"""Hand-eye calibration: where the camera really sits on the arm.

Uses keyframes and the pose graph; nothing else of mapping imports it.
"""
