"""The sentences of `carom run`: each stands in docs/scoring.md with when it is said, and no other is said."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from pathlib import Path

import pytest
from tests.lengths import long_after
from tests.stage import cross_checked, disc_at, staged

from carom import Results, Scene
from carom.scenes import CatalogueScene, find_scenes
from carom.studies.cross_check import sentences
from carom.studies.cross_check.document import cross_check_document
from carom.studies.cross_check.sentences import Sentence

ROOT = Path(__file__).resolve().parents[4]
HEADING = "| sentence | when |\n| --- | --- |\n"
#: They have no words of their own by which they could be told, and are looked for by what stands in them.
PARTS = (Sentence.ONE_SCENE, Sentence.LOST, Sentence.VELOCITY, Sentence.TIME)
MINE = staged("mine", disc_at(-1.0, 0.0, 3.0, 0.2, r=0.3), disc_at(1.0, 0.2, -2.0, 0.0, r=0.3), duration_s=1.0)
#: Its impact falls between two frames of 1/60 s, and that of the other on one.
HEAD_ON = staged("head-on", disc_at(0, 0, 4, 0), disc_at(3.02, 0), duration_s=2.0)
AT_A_FRAME = staged("at-a-frame", disc_at(0, 0, 4, 0), disc_at(3, 0), duration_s=2.0)


def found(scenes: Sequence[Scene | CatalogueScene], *engines: str, profile: str = "tuned") -> Results:
    return cross_checked(scenes, ["pic", *engines], profiles=[profile], dts=[1 / 24])


def pattern(sentence: Sentence) -> str:
    """Matches the sentence, whatever is filled in, up to its end."""
    parts = re.split(r"\{\w+\}", sentence.value)
    return ".*?".join(map(re.escape, parts)) + r"(?=\s|$)"


def says(results: Results) -> str:
    return "\n".join(cross_check_document(results).lead)


def test_the_page_has_every_sentence_with_when_it_is_said() -> None:
    """The table of docs/scoring.md has the very words of the code, in their order, and says of each when it is said."""
    page = (ROOT / "docs" / "scoring.md").read_text(encoding="utf-8")
    rows = page.partition(HEADING)[2].partition("\n\n")[0]
    told = re.findall(r"^\| `(.+)` \| (.+) \|$", rows, re.MULTILINE)
    assert [sentence for sentence, _ in told] == [one.value for one in Sentence]
    assert all(when.strip() for _, when in told)


@pytest.mark.parametrize("sentence", Sentence)
def test_every_sentence_is_said_by_the_code(sentence: Sentence) -> None:
    """None is declared that nothing says."""
    folder = Path(sentences.__file__).parent
    code = [path.read_text(encoding="utf-8") for path in folder.glob("*.py") if path.name != "sentences.py"]
    assert f"Sentence.{sentence.name}(" in "".join(code)


@pytest.mark.parametrize(
    ("scenes", "engines", "said", "outcome"),
    long_after(
        2,
        [
            ([MINE], ["pit"], {Sentence.UNPROVEN, Sentence.RUNS}, "velocities off by "),
            ([HEAD_ON], ["pit"], {Sentence.UNPROVEN, Sentence.RUNS}, " ms late"),
            ([AT_A_FRAME], ["pit"], {Sentence.UNPROVEN, Sentence.RUNS, Sentence.LUCKY}, "exact"),
            (find_scenes(["paper/missed"]), ["pit"], {Sentence.REPRODUCES, Sentence.RUNS}, "1 missed of 1 impact."),
            ([MINE, HEAD_ON], ["pit"], {Sentence.NONE_CLOSE, Sentence.UNPROVEN, Sentence.RUNS}, ""),
            ([MINE, HEAD_ON], [], {Sentence.MOST_CLOSE, Sentence.UNPROVEN, Sentence.RUNS}, ""),
        ],
    ),
)
def test_what_is_said_of_a_cross_check_is_in_the_table(
    scenes: Sequence[Scene], engines: Sequence[str], said: set[Sentence], outcome: str
) -> None:
    """These sentences are said, none beside them, and of one scene its outcome."""
    text = says(found(scenes, *engines))
    heard = {one for one in Sentence if one not in PARTS and re.search(pattern(one), text)}
    assert heard == said
    for one in heard:
        text = re.sub(pattern(one), "", text)
    rest = re.compile(rf"({re.escape(scenes[0].name)}( at \S+ s)?: .*{re.escape(outcome)}.*)?" if outcome else "")
    assert rest.fullmatch(text.strip())


def test_an_engine_as_shipped_that_misses_is_said_to() -> None:
    """As shipped, pymunk at 24 frames a second misses the impact of `paper/missed`, and not that of `paper/late`."""
    pytest.importorskip("pymunk", reason="pymunk is not installed")
    text = says(found(find_scenes(["paper/missed", "paper/late"]), "pymunk", profile="default"))
    assert "In 1 of 2 scenes pymunk as shipped misses an impact: paper/missed." in text
    assert not re.search(pattern(Sentence.NO_RUN), text)


def test_where_nothing_ran_or_pic_is_off_that_is_said() -> None:
    """No row with a score: nothing could be scored; a known answer that PIC is off by a thousandth is named."""
    one = found(find_scenes(["paper/late"]), "pit")
    known = {name: (answer, 1e-3) for name, (answer, _) in one.known.items()}
    assert "it does not reproduce paper/late." in says(dataclasses.replace(one, known=known))
    nothing = dataclasses.replace(one, rows=tuple(dataclasses.replace(row, score=None, trace=None) for row in one.rows))
    assert Sentence.NOTHING.value in says(nothing)
