"""Logs of the bus in words and figures.

Reads what was recorded; never sends.
"""
