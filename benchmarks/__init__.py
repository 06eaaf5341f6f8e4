"""Measurements: run as modules, from the checkout; `make bench` runs the short ones."""
