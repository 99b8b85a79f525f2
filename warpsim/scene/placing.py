"""Mistakes that show only when a scene is built (what is inside a file that it names): their places in the scene's text."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from warpsim.scene.nodes import Mapping, Node
from warpsim.scene.overrides import apply_overrides
from warpsim.scene.pointing import point_at
from warpsim.scene.problems import Problem, SceneError
from warpsim.scene.yaml12 import LARGEST_FILE, decode, parse


@contextmanager
def placed_in(path: Path, overrides: Iterable[str] = ()) -> Iterator[None]:
    """Give each mistake that has a path in the scene but no place in its file, raised within, line and column.

    with placed_in(path, overrides): Simulation(load_scene(path, overrides))
    """
    try:
        yield
    except SceneError as error:
        if not any(problem.path and not problem.file for problem in error.problems):
            raise
        root = _root(path, overrides)
        if root is None:
            raise
        raise SceneError([_placed(problem, root) for problem in error.problems]) from None


def _root(path: Path, overrides: Iterable[str]) -> Node | None:
    """Return the tree of the file as it is now; None if it cannot be read any more, or reads otherwise."""
    try:
        with path.open("rb") as file:
            root, _ = parse(decode(file.read(LARGEST_FILE + 1), str(path)), str(path))
        return apply_overrides(root, list(overrides))[0] if isinstance(root, Mapping) else None
    except (OSError, SceneError):
        return None


def _placed(problem: Problem, root: Node) -> Problem:
    """Return a problem with the place of its path, or of the deepest part of it that the text has."""
    if problem.file or not problem.path:
        return problem
    node = point_at(root, tuple(int(part) if part.isdigit() else part for part in problem.path.split("."))).node
    found = node.problem(problem.message, path=problem.path, suggestion=problem.suggestion)
    return replace(found, path=problem.path)
