"""The bus file and what it describes: devices, units, limits.

Reads files; sends nothing.
"""
