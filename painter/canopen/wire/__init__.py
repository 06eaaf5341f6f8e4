"""Ways to a bus, and logs of what passed on it.

Moves frames; does not know what they mean.
"""
