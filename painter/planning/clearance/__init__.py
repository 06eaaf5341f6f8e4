"""What the arm must keep clear of, and quick proofs that it does.

Obstacles, the separating-axis prefilter, the tool beside what stands out. No motion.
"""
