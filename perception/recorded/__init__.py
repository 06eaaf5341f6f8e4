"""Walls of recorded clouds, where no job says where the wall is.

Chooses the wall and the tile, then calls `perception.segmentation`. Files belong to
`io`.
"""
