"""Systems of the hardware station: CANopen drives and gun, the RealSense camera.

The only systems that import a bus or a camera.
"""
