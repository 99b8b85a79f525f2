"""The scenes that come with the program."""

from importlib.util import find_spec
from os.path import isfile
from pathlib import Path

from warpsim.scene.nearest import nearest
from warpsim.scene.problems import Problem, UnknownSceneError


def shipped_scenes() -> dict[str, Path]:
    """Return every shipped scene by name ("campfire", "gallery/storm" as "storm"), sorted by name."""
    package = find_spec("warpsim")
    found: dict[str, Path] = {}
    for folder in package.submodule_search_locations if package else ():
        for path in sorted(Path(folder, "scenes").rglob("*.yaml")):
            found.setdefault(path.stem, path)
    return dict(sorted(found.items()))


def is_path(scene: str) -> bool:
    """Tell whether what a user typed is a file's path and not a shipped scene's name."""
    return "/" in scene or "\\" in scene or scene.lower().endswith((".yaml", ".yml"))


def find_scene(scene: str | Path) -> Path:
    """Return the file of a path or of a shipped scene's name. Raises UnknownSceneError with suggestions for an unknown name."""
    if isinstance(scene, Path) or is_path(scene) or isfile(scene):
        return Path(scene)
    shipped = shipped_scenes()
    if scene in shipped:
        return shipped[scene]
    guess = nearest(scene, shipped) if scene else None
    message = f'no scene is called "{scene[:80]}" (shipped: {", ".join(shipped) or "none"}; or give the path of a file)'
    raise UnknownSceneError([Problem(message, suggestion=guess)])
