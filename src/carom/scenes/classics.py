"""The group `classics`."""

from __future__ import annotations

from carom.scenes.known_answer import CatalogueScene

__all__ = ["classics"]


def classics() -> list[CatalogueScene]:
    """Return the scenes of the group, in order."""
    return []
