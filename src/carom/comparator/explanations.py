"""Conditions for each verdict and grade, as ``carom explain`` and `docs/theory/scoring.md` show them.

A test compares ``explanations.json`` with the tables of `scoring.md`.
"""

from __future__ import annotations

import json
from pathlib import Path

from carom.comparator.grades import Grade
from carom.comparator.verdict import Verdict

_TEXTS = json.loads(Path(__file__).with_suffix(".json").read_text(encoding="utf-8"))

VERDICT_CONDITIONS: dict[Verdict, str] = {Verdict[name]: text for name, text in _TEXTS["verdicts"].items()}
GRADE_CONDITIONS: dict[Grade, str] = {Grade[name]: text for name, text in _TEXTS["grades"].items()}
