"""Importers: read files of engines as scenes."""
