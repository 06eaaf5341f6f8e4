"""Bus logs decoded, summed up and replayed.

Reads recordings; never sends.
"""
