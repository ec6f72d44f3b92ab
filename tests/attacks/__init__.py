"""Attacks on what Carom promises of files, options, journals, reports and processes: ``python -m tests.attacks``.

An attack is a function of a random generator and of a folder of its own that yields, try after try and without end,
what was lost: a sentence, or "" where everything held. It writes and deletes in that folder alone.
"""
