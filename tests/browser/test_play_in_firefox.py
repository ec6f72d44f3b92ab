"""PIC and PIT of the page of `carom play` in Firefox: the bits that they have in Chromium, and so Carom's."""

import json
import os
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page
from tests.browser.test_play import DRIVEN, STEPS
from tests.processes import PATIENT_S

from carom.catalogue import all_scenes
from carom.engines.api.checks import unsupported_reason
from carom.engines.registry import load_adapter
from carom.web.installed_engines import load_page_engines
from carom.web.packages import PACKAGES
from carom.web.page import GALLERY, render_page

pytestmark = pytest.mark.browser

#: Where Firefox listens for who drives it, unless its profile says another port.
_PORT, _START_WITHIN_S = 2828, PATIENT_S
#: What a run says, as text in which every float keeps its bits.
_REFUSED = "not ported to JavaScript"
_SOLVED = f"""(text) => {{
  const [scene, method] = JSON.parse(text);
  try {{
    const run = method === "pic" ? caromPage.pic(scene, 500) : caromPage.pit(scene);
    return JSON.stringify([run.impacts, run.positions, run.velocities], (_, x) => (Object.is(x, -0) ? "-0" : x));
  }} catch (error) {{
    if (error.message.startsWith("{_REFUSED}")) return error.message;
    throw error;
  }}
}}"""


_SHOWN = "() => document.getElementById('sentence')?.textContent ?? ''"


class Firefox:
    """Firefox without a window, driven by its own protocol: Playwright drives builds of its own alone."""

    def __init__(self, program: str, profile: Path) -> None:
        words = [program, "--headless", "--marionette", "--no-remote", "--profile", str(profile)]
        environment = {**os.environ, "HOME": str(profile)}
        self.process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment)
        self._socket = self._connect()
        self._stream = self._socket.makefile("rwb")
        self._read_message()
        self._asked = 0
        self.ask("WebDriver:NewSession", capabilities={})

    def _connect(self) -> socket.socket:
        until = time.monotonic() + _START_WITHIN_S
        while True:
            try:
                found = socket.create_connection(("127.0.0.1", _PORT), 1.0)
            except OSError:
                assert time.monotonic() < until, "Firefox does not listen"
                time.sleep(0.2)
            else:
                found.settimeout(_START_WITHIN_S)
                return found

    def _read_message(self) -> Any:
        length = b""
        while (byte := self._stream.read(1)) != b":":
            length += byte
        return json.loads(self._stream.read(int(length)))

    def ask(self, command: str, **arguments: Any) -> Any:
        """Send a command and return its result."""
        self._asked += 1
        message = json.dumps([0, self._asked, command, arguments]).encode()
        self._stream.write(str(len(message)).encode() + b":" + message)
        self._stream.flush()
        _, _, error, result = self._read_message()
        assert error is None, error
        return result

    def close(self) -> None:
        """End it."""
        self._stream.close()
        self._socket.close()
        self.process.terminate()
        self.process.wait()

    def run(self, function: str, *arguments: Any) -> Any:
        """Call a function of JavaScript in the page."""
        script = f"return ({function})(...arguments)"
        return self.ask("WebDriver:ExecuteScript", script=script, args=list(arguments), sandbox=None)["value"]


@pytest.fixture
def firefox(tmp_path: Path) -> Iterator[Firefox]:
    """Firefox; the test is skipped where there is none."""
    program = shutil.which("firefox-esr") or shutil.which("firefox")
    if program is None:
        pytest.skip("there is no Firefox here: install Debian's package firefox-esr")
    found = Firefox(program, tmp_path)
    yield found
    found.close()


def _open_in_both(firefox: Firefox, browser: Browser, path: Path) -> Page:
    """Open a page in both, and return Chromium's."""
    page = browser.new_page()
    page.goto(path.as_uri())
    page.wait_for_selector("#sentence:not(:empty)")
    firefox.ask("WebDriver:Navigate", url=path.as_uri())
    until = time.monotonic() + _START_WITHIN_S
    while not firefox.run(_SHOWN):
        assert time.monotonic() < until, "the page does not start in Firefox"
        time.sleep(0.1)
    return page


def test_firefox_and_chromium_give_the_same_bits(firefox: Firefox, browser: Browser, tmp_path: Path) -> None:
    """PIC and PIT give the same bits in both browsers, and refuse the same scenes."""
    path = tmp_path / "play.html"
    path.write_text(render_page([all_scenes()[name].scene for name in GALLERY]), encoding="utf-8")
    page = _open_in_both(firefox, browser, path)
    assert firefox.run(_SHOWN) == page.inner_text("#sentence")
    compared = 0
    for entry in all_scenes().values():
        for method in ("pic", "pit"):
            asked = json.dumps([json.loads(entry.scene.model_dump_json()), method])
            answer = page.evaluate(_SOLVED, asked)
            assert firefox.run(_SOLVED, asked) == answer, (entry.name, method)
            compared += not answer.startswith(_REFUSED)
    assert compared > len(all_scenes())
    page.close()


def test_engines_give_the_same_digits_in_both_browsers(firefox: Firefox, browser: Browser, tmp_path: Path) -> None:
    """Each engine gives the same digits in both browsers, in the number of runs that docs/play.md states."""
    engines = load_page_engines(PACKAGES, required=False)
    if len(engines) < len(PACKAGES):
        pytest.skip("the engines from npm are not installed: make engines")
    path = tmp_path / "play.html"
    path.write_text(render_page([all_scenes()[name].scene for name in GALLERY], engines), encoding="utf-8")
    page = _open_in_both(firefox, browser, path)
    page.evaluate("console.warn = () => {}")
    asked = f"const [told, done] = arguments; ({DRIVEN})(told).then((seen) => done(JSON.stringify(seen)));"
    runs = 0
    for name in PACKAGES:
        for key, profile in load_adapter(name).profiles.items():
            for scene in (all_scenes()[one].scene for one in (*GALLERY, "gravity/falling-pair") if key != "located"):
                dt = 1.0 / scene.frame_rate_hz
                if unsupported_reason(scene, load_adapter(name).capabilities, dt):
                    continue
                told = [name, json.loads(scene.model_dump_json()), {**profile.settings(dt), "dt_s": dt}, STEPS]
                answer = firefox.ask("WebDriver:ExecuteAsyncScript", script=asked, args=[told], sandbox=None)["value"]
                assert json.loads(answer) == page.evaluate(DRIVEN, told), (name, key, scene.name)
                runs += 1
    document = Path(__file__).resolve().parents[2] / "docs" / "play.md"
    assert f"in all {runs} runs of {STEPS} steps" in " ".join(document.read_text(encoding="utf-8").split())
    page.close()
