"""The depth camera as geometry and noise: pinhole, stereo model, usable pixels.

No device and no file: pictures come in as arrays and leave as points or pictures.
"""
