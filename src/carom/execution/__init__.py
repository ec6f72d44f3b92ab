"""Runs scenes on engines: plan, scheduler, pools of worker processes, engine runs, timing, scores and journals.

Import names from the modules themselves, so that a worker process loads only what it needs.
"""
