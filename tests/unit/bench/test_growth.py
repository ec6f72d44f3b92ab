"""Run time against the number of discs: what is run, and what is not."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace

import pytest

from carom.adapter import Capabilities, Profile
from carom.bench import growth
from carom.runs.job import Method, UnsupportedError


def test_a_profiles_own_limits_decide(monkeypatch: pytest.MonkeyPatch) -> None:
    """A gas that a profile can't do is refused with the profile's reason, also where the adapter declares more."""

    def settings(dt_s: float) -> Mapping[str, float]:
        return {"dt_s": dt_s}

    profiles = {"narrow": Profile("without walls", settings, capabilities=Capabilities(walls=False))}
    adapter = SimpleNamespace(name="stub", capabilities=Capabilities(), profiles=profiles)
    monkeypatch.setattr(growth, "load_adapter", lambda _name: adapter)
    with pytest.raises(UnsupportedError, match="does not support"):
        growth.GrowthTask(2, Method("stub", "narrow")).carry_out()
