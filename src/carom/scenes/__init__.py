"""The catalogue: scenes with known answers that no code of Carom's made."""

from carom.scenes.catalogue import catalogue, find_scenes
from carom.scenes.known_answer import CatalogueScene, KnownAnswer, KnownImpact, Staged, Tag, deviation

__all__ = [
    "CatalogueScene",
    "KnownAnswer",
    "KnownImpact",
    "Staged",
    "Tag",
    "catalogue",
    "deviation",
    "find_scenes",
]
