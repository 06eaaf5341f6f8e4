"""Arm motion: blends, gun paths, transitions between strokes, dense verification.

Knows nothing of film.
"""
