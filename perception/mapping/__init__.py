"""Mapping: RGB-D frames and arm poses to corrected poses and one surface map."""
