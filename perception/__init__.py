"""Perception of a wall: depth images and clouds in, wall segmentation out."""
