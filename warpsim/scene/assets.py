"""Files that a scene names: meshes, grids, states to start from. They stay under its folder; a Scene built in Python may name any."""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, Field, ValidationInfo
from pydantic_core import PydanticCustomError

from warpsim.scene.base import Spec
from warpsim.scene.nearest import nearest

LARGEST_ASSET = 1 << 30  # bytes
RECORDED = "assets"  # folder of a run folder


class Asset(str):
    """A file's name as the scene has it, and where the file is. Equal to its text."""

    path: Path
    """Where it is."""
    folder: Path | None
    """The scene's folder; None for a scene built in Python."""


def asset_path(*suffixes: str) -> Any:
    """Return the type of a field that names a file of one of the kinds (".npz", …); it holds an Asset."""

    def located(text: str, info: ValidationInfo) -> Asset:
        asset = Asset(text)
        asset.folder = (info.context or {}).get("folder")
        asset.path = Path(text) if asset.folder is None else asset.folder / text
        try:
            what, guess = _obstacle(asset, suffixes)
        except (OSError, ValueError) as error:
            what, guess = f"cannot be read: {getattr(error, 'strerror', None) or error}", None
        if what:
            raise PydanticCustomError("asset", "{what}", {"what": what, "suggestion": guess or ""})
        return asset

    return Annotated[str, Field(min_length=1, max_length=1000), AfterValidator(located)]


def _obstacle(asset: Asset, suffixes: tuple[str, ...]) -> tuple[str | None, str | None]:
    """Return what is wrong with a file, and what was probably meant."""
    path = asset.path
    if path.suffix.lower() not in suffixes:
        return f"must be a {' or '.join(suffixes)} file", None
    if asset.folder is not None and not path.resolve().is_relative_to(asset.folder.resolve()):
        return "must stay under the scene's folder: give the file's path from there", None
    if not path.exists():
        others = path.parent.iterdir() if path.parent.is_dir() else ()
        guess = nearest(path.name, [other.name for other in others if other.suffix.lower() in suffixes])
        return "there is no such file beside the scene", str(Path(asset).with_name(guess)) if guess else None
    if not path.is_file():
        return "is not a regular file", None
    if path.stat().st_size > LARGEST_ASSET:
        return f"is larger than {LARGEST_ASSET >> 20} MiB", None
    return None, None


def recorded_name(asset: Asset) -> str:
    """Return the name under which a run folder keeps a copy, from the folder."""
    kept = asset.path.name if asset.folder is None else asset.removeprefix(f"{RECORDED}/")
    return f"{RECORDED}/{kept}"


def recorded_assets(scene: Any) -> list[tuple[str, Path]]:
    """Return what a run folder copies: for each file that the scene names its name there and where it is."""
    return [(recorded_name(asset), asset.path) for asset in assets_of(scene)]


def assets_of(value: Any) -> Iterator[Asset]:
    """Yield every file that a scene, or a part of one, names."""
    if isinstance(value, Asset):
        yield value
    elif isinstance(value, Spec):
        for name in type(value).model_fields:
            yield from assets_of(getattr(value, name))
    elif isinstance(value, dict | list | tuple):
        for part in value.values() if isinstance(value, dict) else value:
            yield from assets_of(part)
