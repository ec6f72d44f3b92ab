"""Compare PIC on random scenes in which all features meet: ``python -m tests.campaign.features --scenes 20000``.

Each scene is run by PIC and compared with a certified run, with the run in pieces, and with the run by all pairs. It is
also compared with PIC on the same scene rotated by 90 degrees and with its discs in reverse order.
`tests.campaign.envelope` and `tests.campaign.certified_comparison` derive how far roundings may have a run off. Every
difference is saved as a scene file with its reason. With ``--state`` counts add up from call to call. Ctrl-C ends with
the scenes under way. Exit code 1 reports a difference.
"""

import sys
from pathlib import Path

from tests.campaign.campaign import Campaign, Checked
from tests.campaign.feature_checks import check_scene
from tests.campaign.feature_scenes import draw_scene

from carom import save_scene


def check_number(number: int) -> Checked:
    """Return what a campaign counts of the scene of a number."""
    return check_scene(draw_scene(number))


def save_findings(number: int, checked: Checked, out: Path) -> str:
    """Save the scene of a number once for each difference, with the reason as its description."""
    scene, saved = draw_scene(number), ""
    out.mkdir(parents=True, exist_ok=True)
    for finding in checked.findings:
        path = out / f"{number}-{finding.kind.replace(': ', '-').replace(' ', '-')}.toml"
        save_scene(scene.model_copy(update={"description": f"{finding.kind}: {finding.text}"}), path)
        saved += f"; {path}"
    return saved


#: The checks of a scene end after `SCENE_S`, 30 s of processor time, so that only a process that hangs, as in compiled
#: code that hears no signal, takes twenty times as long.
HANGING_S = 600.0

CAMPAIGN = Campaign(
    "tests.campaign.features", __doc__, "scene", ("cases", 100), check_number, HANGING_S, save=save_findings
)

if __name__ == "__main__":
    sys.exit(CAMPAIGN.main())
