"""Check PIC over many millions of impacts: ``python -m tests.campaign --impacts 300e6``.

Gas after gas is drawn and run, and each impact compared with every rule of `tests.checker`. A run is taken up again
from its saved state every 200,000 impacts. With ``--state`` counts add up from call to call, up to ``--impacts`` in
all. Ctrl-C ends with the gases under way. Exit code 1 tells that a rule was broken: which, and how to see it again, is
printed.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from tests.campaign.gases import MOST_DISCS, draw
from tests.campaign.run import checked, run_campaign
from tests.campaign.tally import Tally
from tests.checker import RULES

#: Exit code of a program that Ctrl-C has ended.
INTERRUPTED = 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Return 1 where a rule was broken, 130 after Ctrl-C, else 0."""
    parser = argparse.ArgumentParser("python -m tests.campaign", description=__doc__)
    parser.add_argument("--impacts", type=float, default=1e6, help="how many in all, those of --state included (1e6)")
    parser.add_argument("--jobs", type=int, default=1, help="processes, one core each (1)")
    parser.add_argument("--state", type=Path, help="JSON file in which counts add up from call to call")
    parser.add_argument("--most-discs", type=int, default=MOST_DISCS, help=f"discs of a gas at most ({MOST_DISCS})")
    parser.add_argument("--gas", type=int, help="check only the gas of this number, and print all that is found")
    options = parser.parse_args(arguments)
    tally, ended = Tally(), True
    if options.gas is not None:
        gas = draw(options.gas, most_discs=options.most_discs)
        for finding in tally.add(gas, checked(gas)):
            print(finding.text)
    else:
        tally = tally if options.state is None else Tally.load(options.state)
        ended = run_campaign(tally, options.state, int(options.impacts), options.jobs, options.most_discs)
    print(tally.table())
    print(f"{tally.broken:,} broken rules. Gaps and overlaps are in units of what rounding explains. Rules:")
    for rule, text in RULES.items():
        print(f"- {rule}: {text}")
    return 1 if tally.broken else 0 if ended else INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
