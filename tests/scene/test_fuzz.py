"""Five thousand mutated scenes; 100 000 by python -m tests.scene.fuzz --count 100000."""

from tests.scene.fuzz import run


def test_mutated_scenes_are_loaded_or_refused_in_words():
    report = run(5_000)
    assert report.clean, [*report.tracebacks[:3], *report.hangs[:3], *report.misplaced[:3], *report.unequal[:3]]
    # Both sides are worth something only if neither is rare.
    assert report.accepted > 250 and report.rejected > 3_000
