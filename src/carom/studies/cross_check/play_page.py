"""The play page of a report, and links to it. Readers can throw the discs of the report's scenes on this page."""

from __future__ import annotations

from collections.abc import Iterable
from urllib.parse import quote

from carom.model.scene import Scene

#: File name of the page in the folder of a report.
PLAY_PAGE = "play.html"


def build_play_link(scene: Scene) -> str:
    """Return the relative link to a scene on the play page; empty if the page can't show the scene."""
    from carom.web.page import find_page_limit

    return "" if find_page_limit(scene) else f"{PLAY_PAGE}#{quote(scene.name, safe='')}"


def build_play_page(scenes: Iterable[Scene]) -> str:
    """Build the play page with all scenes that it can show; empty without such scenes."""
    from carom.web.page import add_gallery, render_page

    playable_scenes = [scene for scene in scenes if build_play_link(scene)]
    return render_page(add_gallery(*playable_scenes)) if playable_scenes else ""
