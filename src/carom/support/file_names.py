"""Names of fields in JSON files and journals that differ from the names in the code.

Files keep these names, so that programs and earlier files stay usable.
"""

from __future__ import annotations

from collections.abc import Mapping

#: Name in files by name in the code.
NAMES_IN_FILES: Mapping[str, str] = {
    "bench_start": "sitting",
    "error_ratio": "price",
    "failure_rule": "gives_way",
    "observed_states": "looks",
    "overrides": "tried",
    "passes_until": "stands_at",
    "position_errors_m": "off_m",
    "requested": "asked",
    "test": "line",
    "velocity_errors_m_s": "off_m_s",
}


def name_in_files(name: str) -> str:
    """Return the name of a field in files."""
    return NAMES_IN_FILES.get(name, name)
