"""Transports of CAN frames, and logs of them.

Moves frames; knows nothing of their meaning.
"""
