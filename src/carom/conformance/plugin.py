"""Pytest plug-in that runs the suite. Without ``--carom-engine``, the plug-in only adds its options.

With ``--carom-engine`` the plug-in adds the suite's cases to the collected tests. The repository of the adapter needs
no test file.
"""

from __future__ import annotations

from pathlib import Path

import pytest

MARKER = "carom_conformance: a case of Carom's conformance suite; `-m carom_conformance` runs nothing else"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options."""
    group = parser.getgroup("carom", "Carom's conformance suite")
    group.addoption(
        "--carom-engine",
        action="append",
        metavar="NAME",
        help="adapter to test, by name; or a distribution or package, to test all adapters in it; or 'all'; repeatable",
    )
    group.addoption(
        "--carom-profile",
        action="append",
        default=[],
        metavar="PROFILE",
        help="profile to test, or 'all'; repeatable; if not given: default, tuned and, if it exists, located; "
        "tests that do not depend on a profile always run",
    )
    group.addoption(
        "--carom-known-failures",
        type=Path,
        metavar="FILE",
        help="file of known failures with their reasons (default: carom-known-failures.toml in the rootdir); write the "
        "option with =, because a separate argument FILE can change pytest's rootdir",
    )
    group.addoption(
        "--write-known-failures",
        action="store_true",
        dest="carom_write_known_failures",
        help="update the file of known failures: add new failures without a reason, remove passing tests, and keep "
        "existing reasons",
    )
    group.addoption("--carom-time-limit", metavar="SECONDS", help="time limit of a test in seconds (default: 60)")
    group.addoption(
        "--carom-memory-limit",
        metavar="MEGABYTES",
        help="memory limit of an engine process in megabytes (default: half of the total)",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Plan the suite if it is requested. Invalid options end the run before the first test."""
    engine_names = config.getoption("carom_engine")
    if not engine_names:
        return
    config.addinivalue_line("markers", MARKER)
    from carom.conformance.known_failures import FILE_NAME
    from carom.conformance.suite import make_suite
    from carom.errors import CaromError
    from carom.execution.shared_options import LimitOptions

    limits = {
        "time_limit_s": config.getoption("carom_time_limit"),
        "memory_limit_mb": config.getoption("carom_memory_limit"),
    }
    file, writes = config.getoption("carom_known_failures"), config.getoption("carom_write_known_failures")
    is_new = writes and file is not None and not file.exists()
    try:
        suite = make_suite(
            engine_names,
            config.getoption("carom_profile"),
            None if is_new else file,
            () if is_new else (config.rootpath, config.invocation_params.dir),
            LimitOptions.parse_command_line(limits, before="--carom-"),
        )
    except CaromError as error:
        raise pytest.UsageError(f"--carom-engine: {error}") from error
    from carom.conformance.pytest_items import ConformanceRun

    write_to = (file or suite.known_failures.path or config.rootpath / FILE_NAME) if writes else None
    config.pluginmanager.register(ConformanceRun(suite, write_to), "carom-conformance")
