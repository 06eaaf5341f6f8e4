"""Pages and folders for people: the report, the catalogue of figures.

The top of `run`.
"""
