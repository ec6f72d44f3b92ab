"""`carom play`: what it writes, and what it refuses."""

from __future__ import annotations

import base64
import hashlib
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from carom.cli import app_of
from carom.errors import InputError
from carom.live.linked import PageEngine, linked
from carom.live.packages import PACKAGES, package_script
from carom.live.page import page_html, page_script, with_gallery


def _play(*words: str) -> tuple[int, str]:
    found = CliRunner().invoke(app_of(["play"]), ["play", *words, "--no-open"])
    return found.exit_code, found.output


def test_it_writes_a_page_with_the_scene(tmp_path: Path) -> None:
    """The page has the scene that was named, first of those to choose from, and a policy without unsafe scripts."""
    page = tmp_path / "play.html"
    code, said = _play("paper/late", "-e", "none", "--out", str(page))
    text = page.read_text(encoding="utf-8")
    assert (code, "play.html" in said) == (0, True)
    assert '<script type="application/json" id="scenes">{"paper/late":' in text
    assert "default-src 'none'; script-src 'sha256-" in text
    assert "http" not in text.replace("http-equiv", "")


@pytest.mark.parametrize("wasm", [True, False])
def test_webassembly_is_allowed_only_to_a_page_that_has_it(wasm: bool) -> None:
    """The policy has the engine's hash, and the word for WebAssembly if an engine of the page is made of it."""
    engine = PageEngine("toy", "Toy", {"default": {}}, "0;", "of no licence", wasm=wasm)
    (policy,) = re.findall(r'Content-Security-Policy" content="(.*?)"', page_html(with_gallery(), [engine]))
    assert f"'sha256-{base64.b64encode(hashlib.sha256(b'0;').digest()).decode()}'" in policy
    assert ("'wasm-unsafe-eval'" in policy) == wasm
    assert "'unsafe-eval'" not in policy


def test_an_engine_that_is_not_installed_is_refused_with_what_installs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """An engine that was asked for and whose package is not there is bad usage, and the answer says what to run."""
    monkeypatch.setattr("carom.live.installed.page_engine", lambda *_: None)
    code, said = _play("-e", "rapier2d")
    assert code == 2
    assert "rapier2d is not installed: " in " ".join(said.split())
    assert "npm install" in " ".join(said.split())


def test_a_package_of_another_form_is_refused(tmp_path: Path) -> None:
    """Text that the page must alter and that a release no longer has is an error, not a page that fails later."""
    script = tmp_path / PACKAGES["cannon"].script
    script.parent.mkdir(parents=True)
    script.write_text("exports.World = class {};\n", encoding="utf-8")
    with pytest.raises(InputError, match="is another one than the page knows"):
        package_script(PACKAGES["cannon"], tmp_path)


def test_the_scripts_are_one() -> None:
    """The joined script has no import or export of its own left, which a page from a file can't have."""
    lines = page_script().splitlines()
    assert not [line for line in lines if line.startswith(("import ", "export ", "//"))]


def test_an_import_that_is_not_linked_is_refused() -> None:
    """An adapter that comes to import something else is not put into the page without it."""
    with pytest.raises(InputError, match="imports other"):
        linked("matter", package="", package_name="matter-js", shared="", module='import Other from "other";\n')
