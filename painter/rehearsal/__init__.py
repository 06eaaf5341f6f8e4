"""Stand-ins for the robot: simulated drives with arm, world and camera.

Used by `painter drives` and by tests; a cycle knows nothing of them.
"""
