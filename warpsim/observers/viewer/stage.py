"""What a page is told before the first frame: background, camera, one cloud of points per system, how it looks, and the sliders."""

import numpy as np

from warpsim.observers.viewer.outlines import scene_outlines
from warpsim.observers.viewer.protocol import pack_command
from warpsim.observers.viewer.solids import solid_commands

# Everything of ours hangs under one node, turned so that a scene whose y is up stands in Meshcat's scene, whose z is up.
ROOT = "/warpsim"
_Y_UP_TO_Z_UP = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]

# Top and bottom color of a vertical gradient.
_SKIES = {
    "night": ([0.020, 0.026, 0.043], [0.055, 0.050, 0.055]),
    "dusk": ([0.14, 0.19, 0.27], [0.42, 0.48, 0.55]),
    "day": ([0.78, 0.85, 0.92], [0.965, 0.960, 0.945]),
}
_FINE = 0.06  # width of a spring that is drawn on a surface, in lengths of springs
_PALE = 0.75  # luma from which a thing is lost against the day


def stage_commands(scene) -> list[bytes]:
    """Return the commands that set an empty page up for `scene`; sent again, they start the page afresh.

    Reads the scene's name, camera, sky and controls and the look of each system.  System number n draws what comes in slot n.
    """
    looks = [(name, system.look) for name, system in scene.systems.items()]
    sky = scene.viewer.sky if scene.viewer.sky != "auto" else _sky([look for _, look in looks])
    top, bottom = _SKIES[sky]
    commands = [
        {"type": "delete", "path": ROOT},
        {"type": "set_property", "path": "/Background", "property": "top_color", "value": top},
        {"type": "set_property", "path": "/Background", "property": "bottom_color", "value": bottom},
        {"type": "set_property", "path": "/Grid", "property": "visible", "value": False},
        {"type": "set_property", "path": "/Axes", "property": "visible", "value": False},
        {"type": "set_transform", "path": ROOT, "matrix": _Y_UP_TO_Z_UP},
        {
            "type": "warpsim_scene",
            "name": str(scene.name),
            "fps": float(scene.time.fps),
            "sky": sky,
            "haze": bottom,
            "ground": bool(scene.viewer.ground),
            "camera": _camera(scene.camera),
            "root": ROOT,
        },
        {"type": "warpsim_controls", "controls": [_control(slider) for slider in scene.sliders]},
    ]
    # The number keeps two paths apart whatever characters the names hold.
    commands += [_cloud(slot, name, look) for slot, (name, look) in enumerate(looks)]
    commands += solid_commands(scene)
    for kind, ends in scene_outlines(scene).items():
        if ends:
            commands.append({"type": "warpsim_lines", "key": kind, "points": 2, "places": ends, "shown": kind in scene.viewer.show})
    return [pack_command(command) for command in commands]


def _cloud(slot: int, name: str, look) -> dict:
    path = f"{ROOT}/{slot + 1} {name}"
    return {"type": "warpsim_cloud", "slot": slot, "name": name, "path": path, "shape": look.as_, "blend": look.blend}


def net_commands(scene, frame) -> dict[str, bytes]:
    """Return by key the commands that join the points of a frame's networks; they hold for the whole run."""
    commands = {}
    for slot, (name, system) in enumerate(scene.systems.items()):
        if frame[name].is_network:
            commands[f"net {slot}"] = pack_command(_net(slot, frame[name], system.look))
    return commands


def _net(slot: int, system, look) -> dict:
    shown = look.show or (("surface",) if len(system.topology["triangles"]) else ("points", "springs"))
    width = look.width if look.width is not None else 0.4 * max(size for _, size in look.size.stops)
    numbers = {key: np.ascontiguousarray(system.topology[key], "<u4").tobytes() for key in ("springs", "triangles")}
    parts = {"points": "points" in shown, "lines": "springs" in shown, "surface": "surface" in shown}
    fine = width if look.width is not None else min(width, _FINE * _typical_length(system))
    widths = {"width": float(width), "fine": float(fine)}
    return {"type": "warpsim_net", "slot": slot, **widths, **parts, **numbers}


def _typical_length(system) -> float:
    """Return the median length of a network's springs at this frame [m]."""
    ends = system.position[system.springs].astype(float)
    return float(np.median(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))) if len(ends) else 0.0


def _control(slider) -> dict:
    """What a page needs of a slider; it answers with the slider's place in the list, so no name comes back from it."""
    value = None if slider.value is None else float(slider.value)
    words = {"path": str(slider.path), "label": str(slider.label)}
    return words | {"min": float(slider.min), "max": float(slider.max), "value": value}


def lines_command(key: str, paths: np.ndarray) -> dict:
    """Return the command that draws polylines, (n, k, 3) [m]; raises ValueError for another shape."""
    paths = np.asarray(paths, np.float32)
    if paths.ndim != 3 or paths.shape[1] < 2 or paths.shape[2] != 3:
        raise ValueError(f"polylines have shape (n, k >= 2, 3), not {paths.shape}")
    paths = paths[np.isfinite(paths).all(axis=(1, 2))]
    # Bytes, which msgpack carries as they are; the page reads them as float32.
    return {"type": "warpsim_lines", "key": key, "points": paths.shape[1], "places": paths.astype("<f4").tobytes(), "shown": True}


def _sky(looks: list) -> str:
    """Light that adds up needs the night, pale things the dusk; all else reads best by day."""
    if not looks or any(look.blend == "additive" for look in looks):
        return "night"
    colors = [color for look in looks for _, color in look.color.stops]
    luma = [0.299 * red + 0.587 * green + 0.114 * blue for red, green, blue, _ in colors]
    return "dusk" if sum(luma) >= _PALE * len(luma) else "day"


def _camera(camera) -> dict | None:
    if camera is None:
        return None
    return {
        "eye": [float(x) for x in camera.eye],
        "target": [float(x) for x in camera.target],
        "field_of_view": float(camera.field_of_view),
    }
