"""Run folders: what a run leaves, its figures and its report page."""
