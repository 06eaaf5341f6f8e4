"""What is found: masks, maps, film, bounds. Hours, not minutes."""
