"""Writes the robot's URDF files and meshes: `python -m painter_models.generate`.

Masses, inertias, collision shapes and pictures of one link come from one description
here, so that they agree. Run it from the root of the checkout after an edit; a test
compares what it would write with the files that are there.
"""
