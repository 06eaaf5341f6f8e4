"""Models of Painter as installed data: robot, camera, gun, scenes and scenarios."""
