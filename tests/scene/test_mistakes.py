"""Mistakes in scenes: every one at its line and column, in words, with what was meant."""

import pytest

from tests.scene.samples import EVERYTHING, FOLDER
from tests.scene.typing_mistakes import ALL, Mistyped
from warpsim.scene import SceneError, load_text


def problems_of(text: str, overrides=()) -> list:
    with pytest.raises(SceneError) as error:
        load_text(text, "scene.yaml", overrides, folder=FOLDER)
    return error.value.problems


def told(mistyped: Mistyped) -> tuple[bool, bool, str]:
    """Return whether the line and the suggestion are right, and the report."""
    assert EVERYTHING.count(mistyped.old) == 1, f"{mistyped.old!r} must occur once"
    before, after = EVERYTHING.split(mistyped.old)
    line = before.count("\n") + 1 + mistyped.below
    text = before + mistyped.new + after
    report = problems_of(text)
    at_line = [problem for problem in report if problem.line == line]
    right_words = any(
        mistyped.says in problem.message and (not mistyped.meant or problem.suggestion == mistyped.meant) for problem in at_line
    )
    return bool(at_line), right_words, "\n".join(map(str, report))


@pytest.mark.parametrize("mistyped", ALL, ids=lambda m: m.new.strip().replace("\n", "⏎")[:40] or m.old[:40])
def test_the_line_is_right(mistyped):
    right_line, _, report = told(mistyped)
    assert right_line, report


def test_nine_suggestions_in_ten_are_right():
    wrong = [mistyped for mistyped in ALL if not told(mistyped)[1]]
    assert len(ALL) >= 100
    print(f"\n{len(ALL)} typing mistakes, {len(ALL) - len(wrong)} right suggestions")
    assert len(wrong) <= 0.1 * len(ALL), "\n".join(f"{m.new!r}: {told(m)[2]}" for m in wrong)
