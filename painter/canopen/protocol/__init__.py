"""CANopen and CiA 402 as standards: frames, types, states, SDO, PDO maps, codes.

No device, no file, no time.
"""
