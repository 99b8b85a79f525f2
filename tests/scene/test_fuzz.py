"""Five thousand mutated scenes; 100 000 by python -m tests.scene.fuzz --count 100000."""

import pytest

from tests.scene.fuzz import run


@pytest.mark.parametrize("first", range(0, 5_000, 1_000))
def test_mutated_scenes_are_loaded_or_refused_in_words(first):
    report = run(1_000, first=first)
    assert report.clean, [*report.tracebacks[:3], *report.hangs[:3], *report.misplaced[:3], *report.unequal[:3]]
    # Both sides are worth something only if neither is rare.
    assert report.accepted > 50 and report.rejected > 600
