"""Drake LeafSystems, one a file: wiring around pure functions.

`brain` runs on every robot, `simulated` and `hardware` are the two bodies. Two systems
never import each other; they share `ports`, `values` and `stage`.
"""
