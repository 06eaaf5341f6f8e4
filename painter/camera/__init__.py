"""The robot's depth camera: librealsense, its clock, and what happens when it goes."""
