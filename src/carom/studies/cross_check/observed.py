"""Journal of a cross-check: complete traces of jobs, so that an interrupted cross-check can be resumed.

Run times are not in the journal, because only times measured in one session can be compared.
"""

from __future__ import annotations

from functools import partial

from carom.execution.cache_key import JobKey
from carom.execution.codec import CarriedTrace
from carom.execution.journal import Journal, JournalEntry
from carom.model.trace import Trace

#: The form of a job whose states are kept for drawing; see `carom.execution.cache_key.JobKey`.
DRAWN = "drawn"

#: Opens the journal of a cross-check, stamped with its options.
observed_journal = partial(Journal[JobKey, Trace], "traces", JournalEntry[JobKey, CarriedTrace])
