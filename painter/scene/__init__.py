"""Scene descriptions: geometry for the simulator, truth for the figures."""
