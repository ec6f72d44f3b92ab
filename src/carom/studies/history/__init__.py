"""What changed between releases of an engine: today's adapter and scenes, on releases from the engine's registry."""
