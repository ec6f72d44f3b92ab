"""Check PIC over many millions of impacts: ``python -m tests.campaign --impacts 300e6``.

The command runs random gases and checks each impact with every rule of `tests.checker`. Every 200,000 impacts it
resumes the run from its saved state. With ``--state`` counts add up over calls, up to ``--impacts`` in total. After
Ctrl-C the command finishes the current gases. With exit code 1 a rule was broken; the output has the rule and a command
that repeats the gas. The unit of gaps and overlaps is the bound of the rounding errors.
"""

import sys

from tests.campaign.campaign import Campaign
from tests.campaign.gas_checks import check_gas
from tests.campaign.gases import MOST_DISCS

#: A gas has up to about a million impacts and no time limit of its own. It takes seconds, or minutes on a busy machine.
HANGING_S = 3600.0

CAMPAIGN = Campaign(
    "tests.campaign", __doc__, "gas", ("impacts", 1e6), check_gas, HANGING_S, sizes={"most_discs": MOST_DISCS}
)

if __name__ == "__main__":
    sys.exit(CAMPAIGN.main())
