"""Physics on top of the core: functions of their arguments alone.

`time_of_impact`, `impact_law` and `rough_impact` are for arrays. `features`, `wall_features` and `numbered` build the
features of finite walls that the core reads. `exact_quartic` solves what the core leaves undecided. All formulas of one
impact are in the headers of `carom.core`.
"""
