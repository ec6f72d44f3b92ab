"""The pure physics: times of impact and laws of impact. Everything here is a function of its arguments alone.

A file is named by what meets and what is asked: `pair_time`, `wall_time`, and `_falling` where gravity acts; those of
arrays are `pair_times` and `time_of_impact`, and `wall_times` is compiled for who asks one by one. `features` are what
finite walls are made of; `feature_time` meets any. `impact_law`, `friction` and (of arrays) `rough_impact` serve any
bodies.
"""
