"""Pytest classes of the suite: a collector for each adapter, an item for each case, and hooks for the output."""

from __future__ import annotations

import shlex
from collections.abc import Generator, Iterator, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from carom.conformance.cases import Case
from carom.conformance.suite import EnginePlan, Suite
from carom.conformance.violation import NotApplicable, Setup, Violation
from carom.engines.registry import format_engine_argument
from carom.errors import CaromError
from carom.model.scene_file import save_scene
from carom.support.formatting import format_step_option

if TYPE_CHECKING:
    from _pytest._code.code import TerminalRepr

PREFIX = "carom"


class EngineCollector(pytest.Collector):
    """Collector of all cases of one adapter."""

    engine: EnginePlan
    known: Mapping[str, str]

    def collect(self) -> Iterator[pytest.Item]:
        """Yield an item for each case. If the engine is unavailable, yield one skipped item with the reason."""
        info = self.engine.info
        missing = Case("available", lambda _: None, "The engine is installed.", info.unavailable)
        for case in self.engine.cases or (missing,):
            item = CaseItem.from_parent(self, name=case.name)
            item.case, item.engine = case, self.engine
            item.add_marker("carom_conformance")
            reason = self.known.get(f"{info.name}::{case.name}")
            if reason is not None:
                item.add_marker(pytest.mark.xfail(reason=reason, strict=True))
            yield item


class CaseItem(pytest.Item):
    """One case of one adapter."""

    case: Case
    engine: EnginePlan

    def runtest(self) -> None:
        """Run the check."""
        if self.case.skip:
            pytest.skip(self.case.skip)
        assert self.engine.subject is not None  # noqa: S101 - the only case of an unavailable engine is skipped
        try:
            self.case.run(self.engine.subject)
        except NotApplicable as reason:
            pytest.skip(str(reason))

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: object = None) -> str | TerminalRepr:  # noqa: ARG002 - pytest's signature
        """Return a text with the expected and the found value, the scene and the command, but without a traceback."""
        error = excinfo.value
        if not isinstance(error, CaromError):
            return super().repr_failure(excinfo)
        lines = [error.what if isinstance(error, Violation) else str(error), f"  must hold  {self.case.meaning}"]
        if isinstance(error, Violation):
            lines += [f"  expected   {error.expected}", f"  got        {error.found}"]
            if error.setup is not None:
                lines += [f"  scene      {error.setup}", f"  reproduce  {self._format_command(error.setup)}"]
        rerun = ["pytest", "--carom-engine", format_engine_argument(self.engine.info.name), "-k", self.case.name]
        lines.append(f"  again      {shlex.join(rerun)}")
        return "\n".join(lines)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """Return the file, the line and the heading that pytest shows for a failure."""
        return self.path, 0, f"{self.engine.info.name}::{self.case.name}"

    def _format_command(self, setup: Setup) -> str:
        scene = setup.scene.name
        if not setup.catalogued:
            cache = getattr(self.config, "cache", None)  # the attribute does not exist with -p no:cacheprovider
            if cache is None:
                return f"the scene is {scene!r} in carom.conformance.suite_scenes"
            path = cache.mkdir("carom") / f"{scene}.toml"
            save_scene(setup.scene, path)
            scene = str(path.relative_to(Path.cwd())) if path.is_relative_to(Path.cwd()) else str(path)
        options = ["-e", format_engine_argument(self.engine.info.name), "-p", setup.profile]
        return shlex.join(["carom", "run", scene, *options, "--dt", format_step_option(setup.dt_s)])


def _format_failure(error: CaromError) -> str:
    """Return the failure in one line."""
    return (error.what if isinstance(error, Violation) else str(error)).partition("\n")[0]


class ConformanceRun:
    """Pytest hooks of a run of the suite."""

    def __init__(self, plan: Suite, write_to: Path | None = None) -> None:
        """Create the hooks for a plan.

        Args:
            plan: Plan of the suite.
            write_to: The file of known failures to update; None for no update.
        """
        self._plan, self._file, self._write_to = plan, plan.known_failures, write_to
        self._failed: dict[str, str] = {}
        self._passed: set[str] = set()

    @pytest.hookimpl(tryfirst=True)
    def pytest_collection_modifyitems(self, session: pytest.Session, items: list[pytest.Item]) -> None:
        """Add the items of the suite to the collected items, before -k, -m and --deselect are applied."""
        for engine in self._plan.engines:
            name = engine.info.name
            collector = EngineCollector.from_parent(session, name=name, nodeid=f"{PREFIX}::{name}")
            collector.engine, collector.known = engine, self._file.reasons
            items.extend(session.genitems(collector))  # this call also reports the items to pytest

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(
        self, item: pytest.Item, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """Report a known failure as failed if the case passes or does not apply."""
        report = yield
        if not isinstance(item, CaseItem) or report.when != "call":
            return report
        name = f"{item.engine.info.name}::{item.case.name}"
        reason = self._file.reasons.get(name)
        # The controller of pytest-xdist writes the file of known failures. So the message is stored in an attribute
        # that pytest-xdist sends to the controller.
        if reason is None and report.failed and call.excinfo and isinstance(call.excinfo.value, CaromError):
            vars(report)["carom_failed"] = [name, _format_failure(call.excinfo.value)]
        elif reason is not None and not hasattr(report, "wasxfail"):
            vars(report)["carom_passed"] = name
        if reason is not None and not hasattr(report, "wasxfail") and not item.config.option.runxfail:
            how = "passes" if report.failed else "does not apply"
            report.outcome = "failed"
            report.longrepr = f"XPASS(strict): {name} {how}, but {self._file.path} lists it ({reason}): remove it"
        return report

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Collect the failed and passed cases for the file of known failures."""
        if failure := getattr(report, "carom_failed", None):
            name, message = failure
            self._failed[name] = message
        elif name := getattr(report, "carom_passed", ""):
            self._passed.add(name)

    def pytest_report_header(self) -> list[str]:
        """Return the header: versions, engines and known failures."""
        lines = [f"carom {version('carom')}: conformance of {', '.join(p.info.name for p in self._plan.engines)}"]
        if self._file.path is not None:
            lines.append(f"known failures: {self._file.path} ({len(self._file.reasons)})")
        return lines

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Print for each engine the numbers of passed, failed and skipped cases, and of known failures."""
        if terminalreporter.config.option.collectonly:
            return
        write = terminalreporter.write_line
        terminalreporter.section("carom conformance")
        for plan in self._plan.engines:
            info, stats = plan.info, terminalreporter.stats
            prefix = f"{PREFIX}::{info.name}::"
            passed, failed, errors, skipped, known = (
                sum(getattr(report, "nodeid", "").startswith(prefix) for report in stats.get(outcome, []))
                for outcome in ("passed", "failed", "error", "skipped", "xfailed")
            )
            counts = f"{passed} passed, {failed + errors} failed, {skipped} skipped, {known} known failures"
            # an engine from a manifest has no distribution
            brought = f" ({info.distribution})" if info.distribution else ""
            write(f"{info.name}: {info.engine} {info.version}{brought}: {counts}")
        if self._write_to is not None:
            write(self._update_known_failures(self._write_to))

    def _update_known_failures(self, path: Path) -> str:
        """Update the file of known failures, and return a line that describes the changes."""
        try:
            without_reason = self._file.write(path, self._failed, self._passed)
        except CaromError as error:
            return f"known failures were not written: {error}"
        summary = f"{path}: {len(self._failed)} known failures added, {len(self._passed)} dropped"
        return f"{summary}; cases that need a reason: {len(without_reason)}" if without_reason else summary

    def pytest_sessionfinish(self) -> None:
        """End the worker processes of all engines."""
        for plan in self._plan.engines:
            if plan.subject is not None:
                plan.subject.close()
