"""The compiled extension: its sources, its build and its rounding."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from tests.cases import each, release_after

import carom
from carom.core import built, extension

PACKAGE = Path(carom.__file__).parent


def test_missing_extension_error_names_the_build_command(tmp_path: Path) -> None:
    """Importing Carom from an unbuilt source tree raises one ImportError with the folder and the build command."""
    package = tmp_path / "carom"
    shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__", "*.js", "*.html", "*.so", "*.pyd"))
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    command = [sys.executable, "-S", "-c", "import carom"]  # without an editable install, which has modules elsewhere
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    message = done.stderr.splitlines()[-1]
    assert message.startswith(f"ImportError: Carom's compiled extension in {package} cannot be loaded (")
    assert message.endswith("; build it with python setup.py build_ext --inplace, or install the source tree with pip")
    assert done.stderr.count("Traceback") == 1


@each("edited, touched, stale", release_after(1, [(True, True, True), (False, True, False), (False, False, False)]))
def test_stale_extension_is_reported_after_a_source_edit(
    edited: bool, touched: bool, stale: bool, tmp_path: Path
) -> None:
    """A header edited after the build is reported with the rebuild command; a newer file date alone is not."""
    package = tmp_path / "carom"
    skipped = shutil.ignore_patterns("__pycache__", "*.js", "*.html")
    shutil.copytree(PACKAGE, package, ignore=skipped, copy_function=shutil.copy2)
    source = package / "core/impact_law.h"
    if edited:
        source.write_text(source.read_text() + "/* A comment more. */\n")
    if touched:
        later = Path(package / "core/built.abi3.so").stat().st_mtime + 10.0
        os.utime(source, (later, later))
    code = """
import warnings
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    from carom.core import extension
    notes = extension.find_extension_notes()
print(extension.__file__, [w.category.__name__ for w in caught], notes)
"""
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert str(package) in done.stdout
    said = "build it again with python setup.py build_ext --inplace --force" in done.stdout
    assert (said, "StaleExtensionWarning" in done.stdout) == (stale, stale)
    assert said or "[] ()" in done.stdout


def test_sources_digest_changes_with_every_source_change(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An edited, renamed or added source changes the digest; Windows line ends do not."""
    monkeypatch.setattr(extension, "__file__", str(tmp_path / "core" / "extension.py"))
    (tmp_path / "a.pxd").write_bytes(b"x\ny\n")
    digests = [extension.compute_sources_digest()]
    (tmp_path / "a.pxd").write_bytes(b"x\r\ny\r\n")
    assert extension.compute_sources_digest() == digests[0]
    (tmp_path / "a.pxd").write_bytes(b"x\nz\n")
    digests.append(extension.compute_sources_digest())
    (tmp_path / "a.pxd").rename(tmp_path / "b.pxd")
    digests.append(extension.compute_sources_digest())
    for name in ("c.pyx", "d.h", "e.c"):
        (tmp_path / name).write_bytes(b"")
        digests.append(extension.compute_sources_digest())
    assert len(set(digests)) == len(digests)


# The extension that is installed, wherever it was built, rounds each operation by itself: its bits rest on that -------


def test_product_and_sum_are_rounded_separately() -> None:
    """The compiled extension rounds a product before it is subtracted: no fused multiply-add."""
    # (1 + 2^-27)^2 is 1 + 2^-26 + 2^-54. A rounded product loses the last term, so the difference is 0.
    a = 1.0 + 2.0**-27
    assert built.less_product(1.0 + 2.0**-26, a, a) == 0.0


def test_every_operation_is_rounded_to_a_double() -> None:
    """The installed extension evaluates doubles as doubles (FLT_EVAL_METHOD is 0)."""
    assert built.EVALUATION_METHOD == 0


# The overview in `carom_core.h` lists every file of the core, and no file that does not exist -------------------------


CORE = Path(__file__).parents[3] / "src/carom/core"
SUFFIXES = (".h", ".c", ".pyx", ".pxd", ".pyi")


def test_core_overview_lists_exactly_the_existing_files() -> None:
    """The overview in carom_core.h lists every file of the core, and no file that does not exist."""
    text = (CORE / "carom_core.h").read_text(encoding="utf-8")
    overview = text[text.index("FILES.") : text.index("*/")]
    listed = set()
    for name, more in re.findall(r"^     ([\w/]+\.\w+)((?:, \.\w+)*)", overview, re.MULTILINE):
        listed |= {name} | {Path(name).with_suffix(suffix).as_posix() for suffix in re.findall(r"\.\w+", more)}
    files = {path.relative_to(CORE).as_posix() for path in CORE.rglob("*") if path.suffix in SUFFIXES}
    assert listed == files - {"carom_core.h"}
