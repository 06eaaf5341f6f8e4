"""Painter: a robot that looks at a wall, works out what to paint, and paints it."""
