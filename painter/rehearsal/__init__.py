"""What stands in for the robot: simulated drives with arm, world and camera.

Serves `painter drives`; a cycle does not know it.
"""
