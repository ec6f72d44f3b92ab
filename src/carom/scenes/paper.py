"""The group `paper`."""

from __future__ import annotations

from carom.scenes.known_answer import CatalogueScene

__all__ = ["paper"]


def paper() -> list[CatalogueScene]:
    """Return the scenes of the group, in order."""
    return []
