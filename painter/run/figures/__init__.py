"""Figures of a run, computed from the files it left.

DESIGN section 6 defines them. No drawing.
"""
