"""Planning: from segmentation to paint program; geometry without systems.

`config`, `tile`, `zones` and `spray_path` (the values) are open to all rooms. Rooms
import in one direction: arm, clearance and film; strokes and motion; scan and program.
No Drake system, no file but `program/store.py`.
"""
