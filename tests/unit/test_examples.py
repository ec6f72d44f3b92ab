"""Examples in the docstrings of the public names, which the API reference shows."""

import doctest
import io
from pathlib import Path

import pytest
from tests.cases import each, release_after

import carom
from carom.execution.describe_engines import engines

#: Examples that run engines; the others are first, and short.
_RUN_ENGINES = ("advise", "demo", "tune")
_NAMES = [*(name for name in (*carom.__all__, "scene") if name not in _RUN_ENGINES), *_RUN_ENGINES]


@each("name", release_after(len(_NAMES) - len(_RUN_ENGINES), _NAMES))
def test_docstring_example_prints_what_it_shows(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each public name has an example that runs with no import but `carom` and prints what the docstring shows."""
    if name in {"advise", "tune"}:
        pytest.importorskip("pymunk")
    if name in {"certify", "horizon", "CertifiedTrace", "Horizon"}:
        pytest.importorskip("flint")
    if name in {"demo", "plot_beside", "replay"}:
        pytest.importorskip("matplotlib").use("Agg")
    monkeypatch.chdir(tmp_path)
    for variable in ("BROWSER", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(variable, raising=False)  # no example opens a page
    thing = engines if name == "engines" else getattr(carom, name)  # the package of that name is called
    example = doctest.DocTestParser().get_doctest(thing.__doc__ or "", {"carom": carom}, name, None, 0)
    assert example.examples
    output = io.StringIO()
    assert doctest.DocTestRunner().run(example, out=output.write).failed == 0, output.getvalue()
