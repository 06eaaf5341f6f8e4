"""The arm as geometry: kinematics, reach, base placement.

No clearance and no time.
"""
