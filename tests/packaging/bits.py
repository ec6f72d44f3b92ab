"""Every bit of some results: ``python bits.py`` prints a digest of each, the same however Carom was built."""

import hashlib
import json
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2]))  # last: Carom itself is the one installed, wherever that is

from benchmarks.time_of_impact import CLASSES, carom_form, pairs_of_class

from carom import Trace, engines, solve_pic, solve_pit
from carom.catalogue import all_scenes
from carom.core.extension import find_extension_notes

#: Larger scenes take seconds.
MOST_DISCS, MOST_IMPACTS = 40, 200


def trace_bytes(trace: Trace) -> bytes:
    """Return all that a run has found."""
    return (
        b"".join([trace.impacts.tobytes(), trace.final_position_m.tobytes(), trace.final_velocity_m_s.tobytes()])
        + repr((trace.end_time_s, trace.outcome, trace.ambiguous)).encode()
    )


def results() -> dict[str, str]:
    """Return a digest of each result, by name."""
    found: dict[str, bytes] = {}
    for name in CLASSES:
        found[f"pairs: {name}"] = carom_form(pairs_of_class(name, 300, 3)).tobytes()
    for name, entry in all_scenes().items():
        if len(entry.scene.discs) <= MOST_DISCS:
            found[f"pic: {name}"] = trace_bytes(solve_pic(entry.scene, max_impacts=MOST_IMPACTS))
            found[f"pit: {name}"] = trace_bytes(solve_pit(entry.scene))
    return {name: hashlib.sha256(data).hexdigest() for name, data in found.items()}


if __name__ == "__main__":
    found = {info.name: info.distribution for info in engines()}
    sys.stdout.write(json.dumps({"notes": find_extension_notes(), "engines": found, "results": results()}))
