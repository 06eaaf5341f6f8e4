"""Where strokes lie, how fast and with how much paint; their order.

Fits strokes to the film. No arm: `program` finds the transitions.
"""
