"""Systems of the simulated body: drives, camera, gun, film, monitors.

Used by the simulated station and by rehearsals alone.
"""
