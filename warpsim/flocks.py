"""Where a flock starts, from a file that the scene names; nothing in it is trusted."""

import io
import zipfile

import numpy as np

from warpsim.scene import SceneError
from warpsim.scene.problems import Problem


def starting_state(name: str, spec) -> tuple[np.ndarray, np.ndarray]:
    """Return position [m] and velocity [m/s] of a flock's boids, float32 (n, 3) each; zeros where the device draws them at random.

    Raises SceneError for a file that is unreadable, of another kind or shape, or not finite.
    """
    if spec.start.file is None:
        return np.zeros((spec.count, 3), np.float32), np.zeros((spec.count, 3), np.float32)
    where = f"systems.{name}.start.file"
    try:
        arrays = _arrays(spec.start.file.path.read_bytes())
    except OSError as error:
        raise _refusal(where, f"cannot be read: {error.strerror or error}") from None
    for key, array in arrays.items():
        if array is None:
            raise _refusal(where, f'has no array "{key}": it needs position and velocity, ({spec.count}, 3) each')
        if array.shape != (spec.count, 3) or array.dtype.kind not in "fiu":
            raise _refusal(where, f"{key} has shape {array.shape} of {array.dtype}: ({spec.count}, 3) numbers are needed, as count says")
        if not np.isfinite(array).all() or np.abs(array).max(initial=0.0) > 1e9:
            raise _refusal(where, f"{key} of boid {int(np.argmax(~(np.abs(array) <= 1e9).all(axis=1)))} is not finite, or beyond 1e9")
    return arrays["position"].astype(np.float32), arrays["velocity"].astype(np.float32)


def _arrays(data: bytes) -> dict[str, np.ndarray | None]:
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            return {key: file[key] if key in file.files else None for key in ("position", "velocity")}
    except (ValueError, KeyError, EOFError, zipfile.BadZipFile, AttributeError, TypeError):
        return {"position": None, "velocity": None}


def _refusal(where: str, message: str) -> SceneError:
    return SceneError([Problem(message, path=where)])
