"""Changes between releases of an engine, found with today's adapter and scenes on releases from its registry."""
