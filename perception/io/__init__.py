"""Recordings: clouds, depth pictures, RealSense bags, frames, segmentations.

The only room that opens files of other programs; a file is read whole or refused with
file, field and value. It computes nothing about walls.
"""
