"""Drake LeafSystems of the brain and of the simulated body."""
