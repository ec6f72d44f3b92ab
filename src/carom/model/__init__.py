"""What is simulated and what happened: scenes, walls, arrays, and traces."""
