"""The page of the same bits: what it compares tells one bit, and one engine is as it says."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from docs.figures import determinism

import carom
from carom.scenes import all_scenes


def test_one_bit_makes_another_digest() -> None:
    """A run has the digest of its copy, and not that of a run one of whose velocities is the next float."""
    trace = carom.solve_pic(all_scenes()["paper/late"].scene)
    moved = trace.final_velocity_m_s.copy()
    moved[0, 0] = np.nextafter(moved[0, 0], 1e9)
    other = dataclasses.replace(trace, final_velocity_m_s=moved)
    assert determinism.digest(dataclasses.replace(trace)) == determinism.digest(trace) != determinism.digest(other)


@pytest.mark.long
def test_pic_comes_to_the_bits_that_the_page_says() -> None:
    """Carom's own method, asked as `make determinism` asks, is the page's row."""
    words = determinism.words_of("pic", "default")
    row = " | ".join(words[name] for name in (*determinism.COUNTED, "order"))
    assert f"| pic | default | 4 of 4 | {row} |" in determinism.PAGE.read_text(encoding="utf-8")


@pytest.mark.long
def test_a_run_that_ends_its_process_is_not_the_same() -> None:
    """An engine that is not there fails in a process of its own: that is told as ended, and counts as not the same."""
    assert determinism.in_threads("no-such-engine", "default", "") == "ended"
