"""Engines: the adapter interface, engines in other languages, importers of files of engines, and the registry."""
