"""Running scenes on engines: plan, pool, observe, time, score, and the cross-check of many.

Names are imported from the modules, so that a worker process loads no more than it needs.
"""
