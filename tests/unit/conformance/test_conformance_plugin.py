"""The pytest plug-in, run as its users run it: in a process and a folder of its own."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.unit.engines.protocol.programs import manifest_of

from carom.conformance.known_failures import FILE_NAME
from carom.conformance.suite import make_suite, select_engines
from carom.engines.registry import load_adapter
from carom.errors import InputError
from carom.execution.pool import InProcessPool
from carom.execution.shared_options import LimitOptions

Pytest = Callable[..., "subprocess.CompletedProcess[str]"]


def test_without_its_option_the_plugin_imports_nothing_and_says_nothing(project: Path, run_pytest: Pytest) -> None:
    """A run that does not ask for it passes where not even Carom's own dependencies can be imported."""
    (project / "test_own.py").write_text(
        "import sys\n"
        "def test_own():\n"
        "    assert 'carom.conformance.plugin' in sys.modules\n"
        "    loaded = [name for name, it in sys.modules.items() if name.startswith('carom') and it and it.__spec__]\n"
        "    packages = ['carom', *(f'carom.{name}' for name in 'conformance core engines model support'.split())]\n"
        "    own = ['carom.conformance.plugin', 'carom.model.scene_names', 'carom.support.display', "
        "'carom.support.escaping']\n"
        "    extension = ['carom.core._cython', 'carom.core.built', 'carom.core.extension']\n"
        "    assert sorted(loaded) == sorted(packages + own + extension)\n"
    )
    # None in sys.modules makes an import fail as if the package were not there.
    blocked = "sys.modules.update(dict.fromkeys(['numpy', 'pydantic', 'rich', 'typer', 'tomli_w']))"
    done = run_pytest("-q", "-W", "error", "-p", "no:hypothesispytest", before=blocked)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "1 passed" in done.stdout
    assert "conformance" not in done.stdout


@pytest.mark.long
def test_a_repository_without_tests_runs_the_suite(run_pytest: Pytest) -> None:
    """Where there is nothing else to collect, the cases are all there is, and -k chooses among them."""
    done = run_pytest("--carom-engine", "carom-toys", "-rs", "-k", "(sound and declares) or available")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "2 passed, 1 skipped" in done.stdout
    assert "sound: Carom 1.0 (Carom_Toys): 2 passed" in done.stdout
    assert "surely_not_installed is not installed; pip install surely-not-installed" in done.stdout


@pytest.mark.long
def test_the_suite_joins_tests_of_ones_own(project: Path, run_pytest: Pytest) -> None:
    """With own tests, testpaths, strict markers, warnings as errors and xdist, the cases run with the tests."""
    (project / "pyproject.toml").write_text(
        '[tool.pytest.ini_options]\ntestpaths = ["checks"]\nfilterwarnings = ["error"]\n'
        'addopts = ["--strict-markers", "--strict-config"]\n'
    )
    (project / "checks").mkdir()
    (project / "checks" / "test_own.py").write_text("def test_own():\n    assert True\n")
    done = run_pytest("-n", "2", "--carom-engine", "toy_adapters", "-k", "test_own or (sound and declares)")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "3 passed" in done.stdout
    assert "sound: Carom" in done.stdout
    assert ": 2 passed, 0 failed, 0 skipped, 0 known failures" in done.stdout
    alone = run_pytest("--carom-engine", "sound", "-m", "carom_conformance", "--collect-only", "-q")
    assert "carom::sound::energy[tuned]" in alone.stdout
    assert "test_own" not in alone.stdout
    assert not done.stderr


@pytest.mark.long
def test_a_known_failure_that_is_none_fails(project: Path, run_pytest: Pytest) -> None:
    """A listed case that passes, or that does not apply, fails and names the file that has to be put right."""
    (project / "carom-known-failures.toml").write_text(
        '[[known_failure]]\nreason = "it used to"\ncases = ["sound::declares-profiles", "sound::refuses[walls]"]\n'
    )
    done = run_pytest("--carom-engine", "sound", "-k", "declares-profiles or refuses")
    assert done.returncode == 1, done.stdout + done.stderr
    assert "XPASS(strict): sound::declares-profiles passes, but " in done.stdout
    assert "XPASS(strict): sound::refuses[walls] does not apply, but " in done.stdout
    assert "carom-known-failures.toml lists it (it used to): remove it" in done.stdout


@pytest.mark.long
def test_a_case_that_hangs_is_ended_and_a_known_failure_is_counted(project: Path, run_pytest: Pytest) -> None:
    """An engine that gives no answer fails its case in time; where that is known, it is counted and the run passes."""
    (project / "known.toml").write_text('[[known_failure]]\nreason = "it sleeps"\ncases = ["hangs::start[tuned]"]\n')
    chosen = ("--carom-engine", "hangs", "--carom-time-limit", "1", "--carom-known-failures=known.toml", "-k")
    done = run_pytest(*chosen, "start or immovable-discs-alone")
    assert done.returncode == 1, done.stdout + done.stderr
    assert "the engine hangs" in done.stdout
    assert "no answer within 1 s" in done.stdout
    assert ": 0 passed, 1 failed, 0 skipped, 1 known failures" in done.stdout


@pytest.mark.long
def test_an_engine_of_a_manifest_is_summed_up_without_a_distribution(run_pytest: Pytest, tmp_path: Path) -> None:
    """What brings a manifest is nobody's wheel: the last line names the engine and its version alone."""
    done = run_pytest("--carom-engine", str(manifest_of(tmp_path, version="2.5")), "-k", "declares-capabilities")
    assert "toy: toy 2.5: 1 passed, 0 failed" in done.stdout


@pytest.mark.long
@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("soud",), "is named 'soud'; there are: "),
        (("missing",), "surely_not_installed is not installed; pip install surely-not-installed"),
        (("pit", "--carom-time-limit", "0"), "--carom-time-limit must be a positive number of seconds, "),
        (("pit", "--carom-memory-limit", "0"), "--carom-memory-limit must be a positive number of megabytes, "),
    ],
)
def test_a_slip_on_the_command_line_ends_the_run_before_it_begins(
    options: tuple[str, ...], message: str, run_pytest: Pytest
) -> None:
    """An engine that is unknown, or missing, and a limit, under the name that pytest has, are errors of usage."""
    done = run_pytest("--carom-engine", *options)
    assert done.returncode == 4, done.stdout + done.stderr
    assert message in done.stderr, done.stderr


def test_a_wrong_file_makes_no_plan(tmp_path: Path) -> None:
    """A name of no case and a file that is not there are errors."""
    with pytest.raises(InputError, match=r"none\.toml: can't be read"):
        make_suite(["pit"], [], tmp_path / "none.toml", [tmp_path], LimitOptions())
    (tmp_path / FILE_NAME).write_text('[[known_failure]]\nreason = "x"\ncases = ["pit::enrgy[tuned]"]\n')
    with pytest.raises(InputError, match=r"no case 'pit::enrgy\[tuned\]'; did you mean 'pit::energy\[tuned\]'"):
        make_suite(["pit"], [], None, [tmp_path], LimitOptions())


@pytest.mark.usefixtures("in_process")
def test_profiles_are_chosen_and_known_failures_of_others_let_be(tmp_path: Path) -> None:
    """Default, tuned and located are run, or what is asked for; what is about no profile is run in any case."""
    (tmp_path / FILE_NAME).write_text(
        '[[known_failure]]\nreason = "x"\ncases = ["pymunk::times[default-paper/late]"]\n'
    )
    run = {}
    for asked in ((), ("tuned",), ("all",)):
        (engine,) = make_suite(["pymunk"], asked, None, [tmp_path], LimitOptions()).engines
        run[asked] = {case.profile for case in engine.cases}
    assert run[()] == {"", "default", "tuned", "located"}
    assert run["tuned",] == {"", "tuned"}
    assert run["all",] == {"", *load_adapter("pymunk").profiles}
    with pytest.raises(InputError, match=r"--carom-profile: no profile 'tund'; there are: default, tuned, "):
        make_suite(["pymunk"], ["tund"], None, [tmp_path], LimitOptions())


@pytest.mark.long
def test_engines_are_meant_by_name_distribution_or_package() -> None:
    """A word means an adapter, else all of a distribution, however it is spelt, or of a package; each comes once."""

    def names(*words: str) -> list[str]:
        with InProcessPool() as pool:
            return [info.name for info in select_engines(words, pool)]

    assert names("pit", "pic", "pit") == ["pit", "pic"]
    everything = {*names("Carom")}
    assert {"pic", "pit"} < everything
    assert {*names("carom_adapters")} == everything
    assert everything <= {*names("all", "pit")}
