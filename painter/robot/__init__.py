"""The robot made from a scenario: plant, kinematics, limits, planners, reach maps.

Between planning, which knows no scenario, and diagrams, which add the systems.
"""
