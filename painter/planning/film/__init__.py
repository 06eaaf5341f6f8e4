"""The film that spray leaves: deposition, film on a tile, its cost, its preview.

Knows strokes as values; where they lie is decided in `strokes`.
"""
