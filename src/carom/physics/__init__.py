"""The pure physics: times of impact and laws of impact. Everything here is a function of its arguments alone.

A module is named after what meets and what it returns: `pair_time`, `wall_time`, and `_falling` under gravity.
`time_of_impact` is for arrays. `features` are the parts of finite walls, and `feature_time` is for any of them.
`impact_law`, `friction` and (for arrays) `rough_impact` apply to any bodies. The compiled forms are in `carom.core`.
"""
