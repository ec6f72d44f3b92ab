"""What is dealt with out of the loop's way, in which it would cost all others their speed.

Something turns or is driven, or walls have features.
"""

from carom.physics.double_double cimport greater
from carom.solvers.event_driven.driven cimport glides_there, meet_driven_discs, meet_driven_walls
from carom.solvers.event_driven.exits cimport predict_exit
from carom.solvers.event_driven.impacts cimport bring_clock, carry_out_feature, carry_out_pair, carry_out_wall
from carom.solvers.event_driven.layout cimport *
from carom.solvers.event_driven.paths cimport bring_driven
from carom.solvers.event_driven.to_and_fro cimport crushes_one, is_crushed


cdef inline void predict_special(State *s, Index i, Change change) noexcept nogil:
    """Predict what has changed of disc `i`'s future where walls have features or something is driven: after `predict_impact`."""
    if s.driving.count > 0 and change != OF_CELL:
        meet_driven_discs(s, i)
    if change != OF_PARTNER:
        predict_exit(s, i, s.feature_count > 0)
        if s.driving.count > 0:
            meet_driven_walls(s, i)


cdef inline bint carry_out_any(State *s, Index first, Index second, double time, bint wanted) noexcept nogil:
    """Carry out an impact where something turns or is driven, or walls have features; return False where the run ends.

    A disc comes to glide instead, or is crushed: `State.stopped` says which.
    """
    cdef bint crushed = False
    if second >= 0:
        if s.driving.count > 0:
            bring_driven(s, first, greater(time, s.clock.now))
            bring_driven(s, second, greater(time, s.clock.now))
        carry_out_pair(s, first, second, time, wanted, s.record.turns)
        crushed = s.to_and_fro != NULL and crushes_one(s, first, second)
    elif s.feature_count == 0:
        carry_out_wall(s, first, -1 - second, time, wanted, True)
    elif glides_there(s, first, -1 - second, time):
        bring_clock(s, time)
        s.gliding = first
        s.stopped = GLIDES
        return False
    else:
        normal = carry_out_feature(s, first, -1 - second, time, wanted)
        if s.to_and_fro != NULL:
            wall = s.features[-1 - second].wall
            crushed = is_crushed(s, first, -1 - wall, <int>(-1 - second), normal.x, normal.y)
    s.stopped = CRUSHED
    return not crushed
