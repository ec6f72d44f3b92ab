"""Connects Carom to physics engines: adapter interface, protocol for programs, importers of files, and registry."""
