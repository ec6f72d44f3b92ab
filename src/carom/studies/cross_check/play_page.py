"""The page with a report on which the discs of its scenes can be thrown, and where a replay finds its scene there."""

from __future__ import annotations

from collections.abc import Iterable
from urllib.parse import quote

from carom.model.scene import Scene

#: The page's file in the folder of a report.
THROWN = "play.html"


def drag_link(scene: Scene) -> str:
    """Return where a scene's discs can be thrown, from a report in the same folder; empty where they can't."""
    from carom.web.page import beyond_page

    return "" if beyond_page(scene) else f"{THROWN}#{quote(scene.name, safe='')}"


def thrown_page(scenes: Iterable[Scene]) -> str:
    """Return the page with those scenes whose discs can be thrown; empty if there are none."""
    from carom.web.page import page_html, with_gallery

    own = [scene for scene in scenes if drag_link(scene)]
    return page_html(with_gallery(*own)) if own else ""
