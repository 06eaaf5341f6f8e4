"""Where strokes lie, how fast and with how much paint; their order.

Fits strokes to the film; knows neither arm nor time between strokes.
"""
