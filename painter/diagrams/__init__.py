"""Diagrams: the station's two bodies and the whole paint cycle."""
