"""How far the reference of each scene is certified, for every format of the report."""

from __future__ import annotations

from typing import NamedTuple

from carom.comparator import Horizon
from carom.runner import Results

__all__ = ["CERTIFIED_NOTE", "CertifiedLine", "certified_lines"]

CERTIFIED_NOTE = (
    "Errors grow from impact to impact, also those of the reference. A certified run, in which every digit is proven, "
    "says up to which impact the reference may be believed; what comes later is not scored."
)


class CertifiedLine(NamedTuple):
    """A scene and how far its reference is certified: in a few words, and in a sentence."""

    scene: str
    short: str
    sentence: str


def certified_lines(results: Results) -> tuple[CertifiedLine, ...]:
    """Return every scene that was certified, or was to be, in the order of the scenes."""
    return tuple(CertifiedLine(name, _short(found), f"{name}: {found}.") for name, found in results.certified.items())


def _short(found: Horizon | str) -> str:
    if isinstance(found, str):
        return found.partition(";")[0].partition(":")[0]
    return f"certified to impact {found.certified}"
