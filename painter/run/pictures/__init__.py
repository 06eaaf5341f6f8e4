"""Pictures of a run: tile, film, charts, replay; one style for all.

Returns Matplotlib figures or PNG; where they go is decided elsewhere.
"""
