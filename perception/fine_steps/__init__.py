"""Beyond the paper: the mask by steps against the wall's own surface, with reasons.

Surfaces (splines, pieces, corners), steps, votes, what was not seen and why, outlines.
`refine.py` runs them in order. It may use the paper's steps, never the other way round.
"""
