"""Colliders as a page draws them: solid shapes softly lit, containers as glass; where they are comes with every frame."""

import numpy as np

from warpsim.meshes import TriangleMesh, load_mesh

MOST_TRIANGLES = 300_000  # of a mesh that is drawn; a larger one is drawn as the box round it
SMOOTH = 0.7660444  # cosine of 40°: a mesh without sharper edges is shaded as one surface


def solid_commands(scene) -> list[dict]:
    """Return a command per collider of the scene, in the order in which a frame gives their places."""
    if not scene.viewer.colliders:
        return []
    return [_solid(place, spec) for place, spec in enumerate(scene.colliders)]


def _solid(place: int, spec) -> dict:
    glass = spec.action == "kill" or getattr(spec, "side", "outside") == "inside"
    command = {"type": "warpsim_solid", "place": place, "shape": spec.type, "glass": glass}
    match spec.type:
        case "plane":
            return command | {"axis": _numbers(spec.normal)}
        case "sphere":
            return command | {"radius": float(spec.radius)}
        case "box":
            return command | {"size": _numbers(spec.size)}
        case "capsule":
            return command | {"radius": float(spec.radius), "axis": [0.5 * (b - a) for a, b in zip(spec.start, spec.end, strict=True)]}
    mesh = load_mesh(spec.file.path, f"colliders.{place}.file", spec.scale)
    if len(mesh.triangles) > MOST_TRIANGLES:
        low, high = mesh.bounds
        return command | {"shape": "box", "size": _numbers(high - low), "middle": _numbers(0.5 * (low + high))}
    arrays = {"vertices": mesh.vertices.astype("<f4").tobytes(), "triangles": mesh.triangles.astype("<u4").tobytes()}
    return command | arrays | {"smooth": is_smooth(mesh), "glass": glass or spec.thickness is not None}


def is_smooth(mesh: TriangleMesh) -> bool:
    """Tell whether neighboring triangles nowhere meet at a sharp edge."""
    normal = mesh.normals
    ends = np.sort(np.stack([mesh.triangles, np.roll(mesh.triangles, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    order = np.lexsort(ends.T)
    same = (ends[order][1:] == ends[order][:-1]).all(axis=1)
    one, other = normal[order[:-1][same] // 3], normal[order[1:][same] // 3]
    return bool((np.einsum("ij,ij->i", one, other) > SMOOTH).all())


def _numbers(vector) -> list[float]:
    return [float(x) for x in vector]
