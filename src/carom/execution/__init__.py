"""Runs scenes on engines: plan, scheduler, pools of worker processes, engine runs, timing, scores and journals.

Import each name from its module, not from this package, so that a worker process loads only the modules it needs.
"""
