"""The pose graph: constraints between keyframes, planes, mount error and base shift.

Pure least squares on values; no files, no fusion.
"""
