"""The paper's six steps from cloud to label grid, one file a step.

`pipeline.py` runs them in order. Source: Tadic et al. 2021, section 4.4. What goes
beyond the paper lives in `fine_steps`.
"""
