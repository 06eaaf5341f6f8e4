"""Sessions: frames in, map out, live or recorded, with store, resume and report.

The top of mapping: it may use every other room of it.
"""
