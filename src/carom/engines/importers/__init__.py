"""Importers: read worlds in the formats of engines as scenes."""
