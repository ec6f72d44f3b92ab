"""The pytest plug-in, run in its own process and folder, as users run it."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.in_process_pool import InProcessPool
from tests.unit.engines.protocol.programs import write_manifest

from carom.conformance.known_failures import FILE_NAME
from carom.conformance.suite import make_suite, select_engines
from carom.engines.registry import load_adapter
from carom.errors import InputError
from carom.execution.shared_options import LimitOptions

Pytest = Callable[..., "subprocess.CompletedProcess[str]"]


def test_plugin_without_its_option_imports_no_dependencies(project: Path, run_pytest: Pytest) -> None:
    """Without `--carom-engine` the plug-in prints nothing and imports only light modules, without libraries."""
    (project / "test_own.py").write_text(
        "import sys\n"
        "def test_own():\n"
        "    assert 'carom.conformance.plugin' in sys.modules\n"
        "    loaded = [name for name, it in sys.modules.items() if name.startswith('carom') and it and it.__spec__]\n"
        "    packages = ['carom', *(f'carom.{name}' for name in 'conformance core engines support'.split())]\n"
        "    own = ['carom.conformance.plugin', 'carom.support.hooks']\n"
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
def test_suite_runs_together_with_own_tests(project: Path, run_pytest: Pytest) -> None:
    """The suite runs with a project's own strict tests in two processes; its marker selects it alone."""
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
def test_known_failure_that_passes_or_is_skipped_fails(project: Path, run_pytest: Pytest) -> None:
    """A known failure that passes or does not apply fails; the message asks to remove it from the file."""
    (project / "carom-known-failures.toml").write_text(
        '[[known_failure]]\nreason = "it used to"\ncases = ["sound::declares-profiles", "sound::refuses[walls]"]\n'
    )
    done = run_pytest("--carom-engine", "sound", "-k", "declares-profiles or refuses")
    assert done.returncode == 1, done.stdout + done.stderr
    assert "XPASS(strict): sound::declares-profiles passes, but " in done.stdout
    assert "XPASS(strict): sound::refuses[walls] does not apply, but " in done.stdout
    assert "carom-known-failures.toml lists it (it used to): remove it" in done.stdout


@pytest.mark.long
def test_summary_of_manifest_engine_names_engine_and_version(run_pytest: Pytest, tmp_path: Path) -> None:
    """The summary of an engine with a manifest contains its name and version, and no distribution."""
    done = run_pytest("--carom-engine", str(write_manifest(tmp_path, version="2.5")), "-k", "declares-capabilities")
    assert "toy: toy 2.5: 1 passed, 0 failed" in done.stdout


@pytest.mark.long
@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("soud",), "'soud' is not the name of an adapter, "),
        (("missing",), "surely_not_installed is not installed; pip install surely-not-installed"),
        (("pit", "--carom-time-limit", "0"), "--carom-time-limit must be a positive number of seconds, "),
        (("pit", "--carom-memory-limit", "0"), "--carom-memory-limit must be a positive number of megabytes, "),
    ],
)
def test_wrong_command_line_option_is_a_usage_error(options: tuple[str, ...], message: str, run_pytest: Pytest) -> None:
    """An unknown or missing engine and a limit of 0 end the run with pytest's usage error (exit status 4)."""
    done = run_pytest("--carom-engine", *options)
    assert done.returncode == 4, done.stdout + done.stderr
    assert message in done.stderr, done.stderr


def test_missing_or_wrong_known_failures_file_is_refused(tmp_path: Path) -> None:
    """A known failures file that does not exist, or that contains an unknown case, is refused."""
    with pytest.raises(InputError, match=r"none\.toml: can't be read"):
        make_suite(["pit"], [], tmp_path / "none.toml", [tmp_path], LimitOptions())
    (tmp_path / FILE_NAME).write_text('[[known_failure]]\nreason = "x"\ncases = ["pit::enrgy[tuned]"]\n')
    with pytest.raises(InputError, match=r"no case 'pit::enrgy\[tuned\]'; did you mean 'pit::energy\[tuned\]'"):
        make_suite(["pit"], [], None, [tmp_path], LimitOptions())


@pytest.mark.usefixtures("in_process")
def test_suite_runs_default_tuned_and_located_profiles(tmp_path: Path) -> None:
    """The suite runs default, tuned and located, or known chosen profiles, and cases without profile always."""
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
def test_engines_are_selected_by_name_distribution_or_package() -> None:
    """Adapters are selected by their name, distribution (in any spelling) or package, each once."""

    def names(*words: str) -> list[str]:
        with InProcessPool() as pool:
            return [info.name for info in select_engines(words, pool)]

    assert names("pit", "pic", "pit") == ["pit", "pic"]
    everything = {*names("Carom")}
    assert {"pic", "pit"} < everything
    assert {*names("carom_adapters")} == everything
    assert everything <= {*names("all", "pit")}
