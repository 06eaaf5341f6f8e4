"""Beyond the paper: the mask by steps against the wall's own surface, with reasons.

Surfaces (splines, pieces, corners), steps, votes, unseen cells, outlines.
`refine.py` runs them in order. It may use the paper's steps, never the other way round.
"""
