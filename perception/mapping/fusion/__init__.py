"""Fusion of depth pictures into one surface.

`Voxels` sums points by voxel and finds the surface. `VoxelMap` grows by pictures in a
box around a tile; `fuse` takes weighted keyframes without a box and carves.

Takes poses as given; `pose_graph` corrects them.
"""
