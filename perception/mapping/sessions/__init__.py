"""Sessions: frames in, map out, live or recorded, with store, resume and report.

The top room of mapping: it may use all others.
"""
