"""What a cross-check asks: the traces of jobs, whole, so that one that was ended can be continued.

Run times are not in its journal: those that are compared belong to one sitting.
"""

from __future__ import annotations

from functools import partial

from carom.execution.cache_key import JobKey
from carom.execution.codec import CarriedTrace
from carom.execution.journal import Journal, JournalEntry
from carom.model.trace import Trace

#: The form of a job whose states are kept for drawing; see `carom.execution.cache_key.JobKey`.
DRAWN = "drawn"

#: Opens the journal of a cross-check; its stamp is that of its options.
observed_journal = partial(Journal[JobKey, Trace], "traces", JournalEntry[JobKey, CarriedTrace])
