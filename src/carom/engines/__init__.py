"""Engines: the adapter interface, engines in other languages, importers of engines' files, and the registry."""
