"""The run folder: files, values, one writer.

DESIGN section 5 is its contract. No figure is computed here.
"""
