"""Systems of the brain, the same in simulation and on the robot.

None of them reads a `cheat` port or knows which body it has.
"""
