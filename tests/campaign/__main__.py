"""Check PIC over many millions of impacts: ``python -m tests.campaign --impacts 300e6``.

Gas after gas is drawn and run, and each impact compared with every rule of `tests.checker`. A run is taken up again
from its saved state every 200,000 impacts. With ``--state`` counts add up from call to call, up to ``--impacts`` in
all. Ctrl-C ends with the gases under way. Exit code 1 reports that a rule was broken: which, and how to see it again,
is printed. Gaps and overlaps are in units of what rounding explains.
"""

import sys

from tests.campaign.campaign import Campaign
from tests.campaign.gas_checks import check_gas

#: A gas has up to about a million impacts and no time limit of its own. It takes seconds, or minutes on a busy machine.
HANGING_S = 3600.0

CAMPAIGN = Campaign("tests.campaign", __doc__, "gas", ("impacts", 1e6), check_gas, HANGING_S)

if __name__ == "__main__":
    sys.exit(CAMPAIGN.main())
