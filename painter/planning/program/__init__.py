"""Paint programs: clear strokes, transitions, the whole, on disk, and its remainder.

The top of planning beside `scan`.
"""
