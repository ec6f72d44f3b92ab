"""Compare PIC on random scenes in which all features meet: ``python -m tests.campaign.features --scenes 20000``.

Each scene is run by PIC and compared with a certified run, with the run in pieces, and with the run by all pairs. It is
also compared with PIC on the same scene rotated by 90 degrees and with its discs in reverse order.
`tests.campaign.envelope` measures how far roundings may change a run. The command saves every difference as a scene
file with the reason. With ``--state`` counts add up over calls. After Ctrl-C it finishes the current scenes. With exit
code 1 there was a difference.
"""

import sys
from pathlib import Path

from tests.campaign.campaign import Campaign, Checked, Finding
from tests.campaign.feature_checks import check_scene
from tests.campaign.feature_scenes import draw_scene, features_of, law_of

from carom import save_scene


def check_number(number: int) -> Checked:
    """Return what a campaign counts of the scene of a number."""
    scene = draw_scene(number)
    checked = check_scene(scene)
    names = {
        "low_hops": "contact from low hops",
        "kept_contact": "contact kept",
        "modes": "changes of modes",
    }
    sums = {names.get(name, name): getattr(checked, name) for name in ("impacts", "certified", *names)}
    return Checked(
        str(law_of(scene)),
        sums,
        features=features_of(scene),
        findings=[Finding(f"{one.check}: {one.kind}", one.text) for one in checked.findings],
        seconds=checked.seconds,
    )


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
