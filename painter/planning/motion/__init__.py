"""Arm motion: blends, gun paths, transitions between strokes, verification.

Knows nothing of film or of what the strokes are for.
"""
