"""The group `issues`: scenes from real complaints about collision engines, each with its thread."""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.scenes.issues_falling import issues_falling
from carom.scenes.issues_pairs import issues_pairs
from carom.scenes.issues_walled import issues_walled

if TYPE_CHECKING:
    from carom.scenes.complaint import Complaint

__all__ = ["issues"]


def issues() -> list[Complaint]:
    """Return the scenes of the group, in order."""
    return [*issues_pairs(), *issues_walled(), *issues_falling()]
