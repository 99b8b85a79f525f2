"""From a file or a shipped scene's name to a validated Scene, with every mistake at its line and column."""

from collections.abc import Iterable
from pathlib import Path

from warpsim.scene.mistakes import validate
from warpsim.scene.nearest import nearest
from warpsim.scene.nodes import Mapping
from warpsim.scene.overrides import apply_overrides
from warpsim.scene.problems import Problem, SceneError
from warpsim.scene.scene import Scene
from warpsim.scene.shipped import find_scene
from warpsim.scene.yaml12 import LARGEST_FILE, decode, parse


def load_scene(scene: str | Path, overrides: Iterable[str] = (), seed: int | None = None) -> Scene:
    """Load a scene from a path or a shipped scene's name.

    `overrides` are texts "path=value" as of `--set`, applied in order; `seed` replaces the scene's. Raises SceneError with all mistakes
    (UnknownSceneError for an unknown name).
    """
    path = find_scene(scene)
    return load_text(decode(_read(path), str(path)), str(path), overrides, seed, path.parent)


def load_text(
    text: str,
    name: str = "scene",
    overrides: Iterable[str] = (),
    seed: int | None = None,
    folder: Path | None = Path(),  # noqa: B008 (a Path cannot change)
) -> Scene:
    """Load a scene from its text; `name` stands in for the file's name in messages. Raises SceneError with all mistakes.

    The files that it names must lie under `folder`, by default the current one; with None they may lie anywhere.
    """
    root, problems = parse(text, name)
    if not isinstance(root, Mapping):
        raise SceneError([*problems, root.problem('a scene is a mapping of "key: value" lines, beginning with "name: …"')])
    root, more = apply_overrides(root, [*overrides, *([f"seed={seed}"] if seed is not None else [])])
    return validate(root, problems + more, folder)


def _read(path: Path) -> bytes:
    name = str(path)
    try:
        if path.is_dir():
            raise SceneError([Problem("is a folder, not a scene file", name, 1, 1)])
        if not path.exists():
            raise SceneError([Problem("there is no such file", name, 1, 1, suggestion=_near(path))])
        if not path.is_file():
            raise SceneError([Problem("is not a regular file", name, 1, 1)])
        with path.open("rb") as file:
            return file.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise SceneError([Problem(f"cannot be read: {reason}", name, 1, 1)]) from None


def _near(path: Path) -> str | None:
    if not path.parent.is_dir():
        return None
    names = [other.name for other in path.parent.iterdir() if other.suffix in (".yaml", ".yml")]
    guess = nearest(path.name, names)
    return str(path.parent / guess) if guess else None
