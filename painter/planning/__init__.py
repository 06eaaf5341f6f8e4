"""Spray planning: strokes, film, arm motion; geometry without systems."""
