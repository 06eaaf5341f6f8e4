"""The standards CANopen and CiA 402: frames, types, NMT, states, SDO, PDO maps, codes.

Holds no device, file or clock.
"""
