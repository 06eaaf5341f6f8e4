"""Made-up walls and sequences with known truth, for tests, benchmarks and notebooks.

Nothing that runs on a robot imports this room.
"""
