"""Perception of a wall: depth pictures and clouds in, wall segmentation out.

`segmentation.py` is the whole on one page; the rooms below hold its steps. `ground.py`
and `settings.py` are open to every room of the project and need NumPy alone. Nothing
here knows the robot, the paint or a Drake system.
"""
