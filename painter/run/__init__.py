"""Run folders: what a run leaves, its figures, pictures and report page.

Reads what a run left, never a diagram.
"""
