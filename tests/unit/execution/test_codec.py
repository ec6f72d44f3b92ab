"""Answers of workers: decoding returns a value of the declared type or raises a ValidationError."""

import json
from random import Random

import pytest
from pydantic import ValidationError
from tests.attacks.guard import spoil
from tests.cases import each

from carom import solve_pit
from carom.catalogue import all_scenes
from carom.engines.registry import load_adapter
from carom.execution.codec import CarriedTrace, Codec
from carom.execution.job import Answer, Status
from carom.execution.observation.engine_run import ObserveTask, observe_run
from carom.execution.workers.worker_main import build_codec
from carom.model.trace import Trace

SCENE = all_scenes()["paper/missed"].scene


@each("name", ["contact/struck", "tables/box-of-edges"])
def test_trace_keeps_every_bit_through_the_codec(name: str) -> None:
    """A trace with contact modes, states, spins and wall edges equals its encoded and decoded copy."""
    codec = Codec[Trace](CarriedTrace)
    trace = observe_run(load_adapter("pic"), all_scenes()[name].scene, "tuned", 1 / 60)
    assert codec.loads(codec.dumps(trace)) == trace


def test_altered_answer_is_a_value_or_a_validation_error() -> None:
    """Decoding an answer with a random part replaced or removed returns a value or raises a ValidationError."""
    codec, rng, refused = build_codec(ObserveTask), Random(5), 0
    sound = json.loads(codec.dumps((0, Answer(Status.RAN, value=solve_pit(SCENE, frame_rate_hz=60)))))
    trace = json.loads(sound[1]["value"])
    scene = json.loads(trace["scene"])
    for k in range(900):
        altered = [sound, trace, scene]
        altered[k % 3] = spoil(rng, altered[k % 3])
        line = altered[0]
        if k % 3:
            inner = altered[1] if k % 3 == 1 else trace | {"scene": json.dumps(altered[2])}
            line = [0, sound[1] | {"value": json.dumps(inner)}]
        try:
            codec.loads(json.dumps(line).encode())
        except ValidationError:
            refused += 1
    assert refused > 500
    _, place = trace["final_position_m"]
    for wrong in (None, [[1, 4], place]):
        with pytest.raises(ValidationError, match="final_position_m"):
            codec.loads(json.dumps([0, sound[1] | {"value": json.dumps(trace | {"final_position_m": wrong})}]).encode())
