"""Wrong usage of a command: a message and exit code 2, before anything is run or written."""

import shlex
from pathlib import Path

import pytest
from tests.command import carom_command, printed_text

ROOT = Path(__file__).resolve().parents[3]
KEPT = ROOT / "tests" / "earlier_formats" / "results-3.jsonl"

REFUSED = [
    # what is named, and is not there, with what may have been meant
    ("run no-such-file.toml", "can't be read"),
    ("run paper/mised", "did you mean 'paper/missed'"),
    ("run paper/missed -e pimunk", "no engine is named 'pimunk' hint: did you mean 'pymunk'?"),
    ("run paper/missed -e pit -p tunde", "a profile 'tunde' hint: did you mean 'tuned'?"),
    (
        "run paper/missed -e pymunk --set iteration=3",
        "pymunk has no setting 'iteration' hint: did you mean 'iterations'? hint: there are:",
    ),
    ("run paper/missed -e pymunk -e pit --set iterations=5", "pit has no setting 'iterations'"),
    ("certify classics/boxx", "did you mean 'classics/box'"),
    ("scenes 'nowhere/*'", "no scene is named 'nowhere/*'"),
    ("engines pymonk", "no engine is named 'pymonk' hint: did you mean 'pymunk'?"),
    ("engines pymunk --show best", "pymunk has no profile 'best' hint: it has: default, tuned, located"),
    ("stress grasing", "no stress test is named 'grasing' hint: did you mean 'grazing'? hint: `carom stress --list`"),
    ("tune pymunk classics/miss -p best", "pymunk has no profile 'best' hint: it has: default, tuned, located"),
    ("play nowhere.toml", "nowhere.toml"),
    ("diff {kept} nowhere", "nowhere can't be read: No such file or directory hint: give the folder of a report"),
    ("diff {kept} {docs}", "results.jsonl can't be read"),
    ("diff {kept} {kept} --engine pit=bullet", "has no engine or method 'bullet' hint: it has "),
    # what a command is not for
    ("bench", "no scene given"),
    ("bench --grow paper/missed", "takes no scene, got 'paper/missed'"),
    ("advise 'paper/*'", "name one"),
    ("tune pit classics/miss", "the adapter of pit declares no settings to tune"),
    ("play classics/gas", "at most 10 discs"),
    ("play paper", "name one"),
    ("play -e pymunk", "the page can't run pymunk"),
    ("play --out play.txt", "must end in .html"),
    ("diff {kept}", "carom diff OLD NEW"),
    ("engines --show tuned", "--show needs exactly one engine"),
    ("engines pymunk --dt 1/60", "need --show"),
    ("engines pit --show tuned", "the adapter 'pit' cannot print settings as code"),
    ("engines pymunk --show located", "profile 'located' of pymunk cannot be printed as code"),
    ("engines pymunk --show tuned --scene paper", "--scene must name one scene"),
    ("history pymunk --bisect paper:default:1/60", "--bisect must name one scene"),
    ("history pit paper/late", "pit has no registry"),
    ("history pymunk paper/late -p best", "pymunk has no profile 'best'"),
    ("run paper/missed -e pit --retry", "--resume and --retry need the output folder"),
    # what an option can't be
    ("run paper/missed --dt fast", "--dt must be a number of seconds such as 1/240 or 0.004"),
    ("run paper/missed --dt 1/0", "--dt must be a number"),
    ("run paper/missed --dt -1", "0.004 (1.49e-154 to 6.7e153)"),
    ("bench paper/missed --dt 1e300..1e-300:5", "(1.49e-154 to 6.7e153)"),
    ("bench paper/missed --dt 1/60..1/120:99999999", "at most 256 steps"),
    ("bench paper/missed --axes time-error", "'--axes': 'time-error' is not one of 'error-time', 'error-dt'"),
    ("bench paper/missed --phases 1000000", "--phases must be a whole number from"),
    ("bench --grow --discs 1000000000", "--discs must be a whole number from 1 to 100000"),
    ("bench paper/missed -e pit --scheduler nan", "--scheduler must be an address such as tcp://"),
    ("bench --grow --scheduler tcp://host:8786", "--scheduler must be left out, since run time and memory are"),
    ("history pymunk --scheduler tcp://host:8786", "--scheduler must be left out, since each release is installed"),
    ("tune pymunk --timing --scheduler tcp://host:8786", "omit --timing or --scheduler"),
    ("run paper/missed -e pymunk --set iterations", "--set must be NAME=VALUE"),
    ("stress grazing --time-limit 0", "--time-limit must be a positive number of seconds, at most 1e7, got '0'"),
    ("stress small -e pit --memory-limit inf", "--memory-limit must be a positive number of mega"),
    ("advise paper/missed --direction-error 1", "--direction-error must be an angle such as 1deg"),
    ("advise paper/missed --miss-probability 2", "--miss-probability must be 0 or more and below 1"),
    ("certify classics/box --digits 100000", "--digits must be a whole number from 1 to 10000, got '100000'"),
    ("engines pymunk --show tuned --restitution 2", "restitution"),
    ("diff {kept} {kept} --engine pymunk", "--engine must be OLD=NEW"),
    # where nothing can be written
    ("run paper/missed --report /dev/null/report", "Not a directory hint: name another folder by --out"),
    ("scenes paper --save /dev/null/scenes", "/dev/null/scenes: Not a directory"),
]


@pytest.mark.usefixtures("in_process")
@pytest.mark.parametrize(("command", "words"), REFUSED, ids=[command for command, _ in REFUSED])
def test_bad_usage_is_refused_with_exit_code_2(
    command: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Wrong usage gives exit code 2 and a specific message, without a traceback, and leaves no file or folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    result = carom_command(*shlex.split(command.format(kept=KEPT, docs=ROOT / "docs")))
    assert result.exit_code == 2, result.output
    assert words in printed_text(result)
    assert "Traceback" not in result.output
    assert [*tmp_path.iterdir()] == []
