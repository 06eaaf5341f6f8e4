"""The film that spray leaves: deposition, film on a tile, its cost, its preview.

Strokes are values here; `strokes` decides where they lie.
"""
