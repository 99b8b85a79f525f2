"""Validation with every mistake at once, each at its line and column, in words.

pydantic finds what it can in one pass; rules between fields run only where the fields are right. So a scene with mistakes is mended
(misspelled keys renamed, wrong values dropped for their defaults) and validated again, until nothing new turns up.
"""

from pathlib import Path

from pydantic import ValidationError

from warpsim.scene.mending import mend
from warpsim.scene.nodes import Mapping
from warpsim.scene.overrides import OVERRIDE
from warpsim.scene.pointing import point_at
from warpsim.scene.problems import Problem, SceneError
from warpsim.scene.scene import Scene
from warpsim.scene.wording import word

MOST_PASSES = 5
MOST_PER_PASS = 300


def validate(root: Mapping, problems: list[Problem], folder: Path | None) -> Scene:
    """Validate a tree and return its Scene; the files that it names are under `folder` (None: anywhere).

    Raises SceneError with `problems` (found before) and all mistakes, in the order of the text.
    """
    found = list(problems)
    dropped: set[tuple[str | int, ...]] = set()
    for _ in range(MOST_PASSES):
        try:
            scene = Scene.model_validate(root.data(), context={"folder": folder})
        except ValidationError as error:
            errors = error.errors(include_url=False, include_input=False)[:MOST_PER_PASS]
        else:
            if not found:
                return scene
            break
        places = [point_at(root, item["loc"]) for item in errors]
        more = [problem for item, place in zip(errors, places, strict=True) for problem in word(item, place, root, dropped)]
        found += _not_yet_told(more, found)
        if len(errors) == MOST_PER_PASS:
            break  # enough to mend for a while
        mended = mend(root, errors, places, dropped)
        if mended is root:
            break
        root = mended
    raise SceneError(sorted(found, key=_order))


def _order(problem: Problem) -> tuple:
    # Mistakes of the file by place, then those of the overrides.
    override = problem.file.startswith(OVERRIDE)
    return (int(problem.file.removeprefix(OVERRIDE)) if override else 0, problem.line, problem.column)


def _not_yet_told(more: list[Problem], found: list[Problem]) -> list[Problem]:
    told = {(problem.file, problem.line, problem.column) for problem in found}
    fresh = [problem for problem in more if (problem.file, problem.line, problem.column) not in told]
    return list(dict.fromkeys(fresh))
