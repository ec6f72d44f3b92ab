"""Journal of a cross-check: complete traces of jobs, to resume an interrupted cross-check.

The journal has no run times, because only times of one session can be compared.
"""

from __future__ import annotations

from functools import partial

from carom.execution.cache_key import JobKey
from carom.execution.codec import CarriedTrace
from carom.execution.journal import Journal, JournalEntry
from carom.model.trace import Trace

#: The form of a job with states for drawing; see `carom.execution.cache_key.JobKey`.
DRAWN = "drawn"

#: Opens the journal of a cross-check, stamped with its options.
observed_journal = partial(Journal[JobKey, Trace], "traces", JournalEntry[JobKey, CarriedTrace])
