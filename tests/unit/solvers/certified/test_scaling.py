"""Units do not matter: lengths and speeds times powers of two change no digit of a certified run but the exponent."""

from functools import cache
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from tests.cases import each, release_after
from tests.transformed_scenes import in_units

from carom import Scene, certify
from carom.catalogue import catalogue
from carom.solvers.certified.result import CertifiedTrace
from carom.studies.bench.gas import build_gas_scene

#: Impacts of each run.
MOST = 25


def scale_scene(scene: Scene, length: int, speed: int) -> Scene:
    """Return a scene whose lengths and speeds are multiplied by powers of two."""
    return in_units(scene, length=2.0**length, time=2.0 ** (length - speed))


def collect_numbers(certified: CertifiedTrace, length: int = 0, speed: int = 0) -> dict[str, Any]:
    """Return the result of a certified run, as bytes, in units smaller by powers of two."""
    trace, kind = certified.trace, certified.degeneracy
    rows = {
        name: np.ldexp(
            trace.impacts[name], -(length - speed) if name == "time_s" else 0 if name == "normal" else -speed
        )
        for name in trace.impacts.dtype.names or ()
        if name not in ("first", "second")
    }
    return {
        **{name: column.tobytes() for name, column in rows.items()},
        "bodies": trace.impacts[["first", "second"]].tolist(),
        "positions": np.ldexp(trace.final_position_m, -length).tobytes(),
        "velocities": np.ldexp(trace.final_velocity_m_s, -speed).tobytes(),
        "ending": (certified.ending, kind and (kind.kind, kind.bodies, kind.proven)),
        "bits": (certified.precision_bits, certified.replays, certified.commuted),
    }


@cache
def certify_plain_numbers(scene: Scene) -> dict[str, Any]:
    """Return what the certified run of a scene says as it is."""
    return collect_numbers(certify(scene, max_impacts=MOST))


SCENES = [
    build_gas_scene(4, 0.1).model_copy(
        update={"restitution": 0.75, "wall_restitution": 0.5, "gravity_m_s2": (0.25, -2.0)}
    ),
    *(catalogue()[name].scene for name in ("classics/cradle-touching", "classics/galperin-100")),
    build_gas_scene(6, 0.4),
]
POWERS = st.one_of(st.sampled_from([-500, -300, -256, 256, 300, 500]), st.integers(-500, 500))


#: How much more lengths are scaled than speeds: times are scaled by that, and scenes beyond `carom.support.limits` are
#: refused.
DRIFTS = st.integers(-250, 250)


@each("scene", release_after(3, SCENES))
@given(length=POWERS, drift=DRIFTS)
def test_scaling_by_powers_of_two_changes_no_digit(scene: Scene, length: int, drift: int) -> None:
    """Scaling lengths and speeds by 2^-500 to 2^500 changes no digit, order, ending or precision."""
    speed = max(-500, min(500, length - drift))
    if scene.gravity_m_s2 != (0.0, 0.0) and abs(2 * speed - length) > 500:
        return  # such a gravity is refused
    found = certify(scale_scene(scene, length, speed), max_impacts=MOST)
    assert collect_numbers(found, length, speed) == certify_plain_numbers(scene)
