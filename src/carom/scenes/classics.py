"""The group `classics`: textbook scenes, each with an answer from mathematics."""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.scenes.in_line import in_line
from carom.scenes.many_discs import many_discs
from carom.scenes.two_discs import two_discs
from carom.scenes.walled import walled

if TYPE_CHECKING:
    from carom.scenes.known_answer import CatalogueScene

__all__ = ["classics"]


def classics() -> list[CatalogueScene]:
    """Return the scenes of the group, in order."""
    return [*two_discs(), *walled(), *in_line(), *many_discs()]
