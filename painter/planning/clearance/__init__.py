"""Obstacles, and checks that the arm keeps clear of them.

The boxes, the separating-axis prefilter, the tool beside what stands out. No motion.
"""
