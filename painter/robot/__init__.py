"""The robot made from a scenario, and the scene before it.

Plant, kinematics, limits, planners, reach maps, and where the scene truly stands.

Between planning, which knows no scenario, and diagrams, which add the systems.
"""
