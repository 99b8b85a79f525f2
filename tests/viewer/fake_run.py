"""A run made of NumPy arrays: what the viewer reads of a Scene and of a Frame, and nothing else."""

from types import SimpleNamespace

import numpy as np


def fake_scene(
    systems: dict[str, tuple[str, str]],
    camera: SimpleNamespace | None = None,
    name: str = "Fake",
    gray: float = 0.5,
    sliders: tuple = (),
    **viewing,
) -> SimpleNamespace:
    """Return a scene whose `systems` map a name to its look (shape, blend), all of one gray."""
    color = SimpleNamespace(stops=((0.0, (gray, gray, gray, 1.0)),))
    looks = {key: SimpleNamespace(as_=shape, blend=blend, color=color) for key, (shape, blend) in systems.items()}
    return SimpleNamespace(
        name=name,
        camera=camera,
        time=SimpleNamespace(fps=60.0),
        colliders=(),
        viewer=SimpleNamespace(**{"max_points": 250_000, "sky": "auto", "ground": True, "show": (), "colliders": True, **viewing}),
        sliders=[SimpleNamespace(path=path, label=path, min=low, max=high, value=value) for path, low, high, value in sliders],
        flow=(),
        obstacles=(),
        forces=(),
        systems={key: SimpleNamespace(look=look) for key, look in looks.items()},
    )


class FakeSystem:
    """Points at `position` [m], float32 (n, 3), with `color`, uint8 (n, 4), and `size` [m], float32 (n,)."""

    is_network = tears = False

    def __init__(self, position: np.ndarray, color: np.ndarray | None = None, size: np.ndarray | None = None):
        self.position = np.asarray(position, np.float32).reshape(-1, 3)
        self.count = len(self.position)
        self.color = np.full((self.count, 4), 255, np.uint8) if color is None else color
        self.size = np.full(self.count, 0.05, np.float32) if size is None else size

    def packed(self, limit: int | None = None) -> SimpleNamespace:
        """Pack every point, or every k-th so that at most `limit` remain."""
        stride = 1 if limit is None else max(1, -(-self.count // limit))
        position, size = self.position[::stride], self.size[::stride]
        count = len(position)
        low = position.min(axis=0, initial=np.inf) if count else np.zeros(3)
        step = np.maximum(position.max(axis=0, initial=-np.inf) - low, 1e-6) / 65535 if count else np.ones(3)
        size_max = float(size.max(initial=0.0)) or 1.0
        quantized = np.empty((count, 4), np.uint16)
        quantized[:, :3] = np.round((position - low) / step)
        quantized[:, 3] = np.round(size / size_max * 65535)
        return SimpleNamespace(
            count=count,
            position=quantized,
            color=self.color[::stride],
            scale=step.astype(np.float32),
            offset=low.astype(np.float32),
            size_max=size_max,
        )


class FakeFrame(dict):
    """Frame `index` at `time` [s]; maps the names of systems to FakeSystems."""

    def __init__(self, index: int, systems: dict[str, FakeSystem], time: float | None = None):
        super().__init__(systems)
        self.index = index
        self.time = index / 60 if time is None else time
        self.collider_poses = np.zeros((0, 7), np.float32)


def dust(index: int, count: int = 1000) -> FakeFrame:
    """Return frame `index` of `count` random points in one system named dust."""
    rng = np.random.default_rng([index, count])
    color = rng.integers(0, 256, (count, 4), np.uint8)
    return FakeFrame(index, {"dust": FakeSystem(rng.normal(size=(count, 3)), color, rng.uniform(0.01, 0.05, count).astype(np.float32))})


DUST = fake_scene({"dust": ("sprites", "alpha")})
