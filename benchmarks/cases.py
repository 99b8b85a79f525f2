"""The scenes that are measured. Each is a mapping, as it would stand in YAML, so that nothing here is a private fast path."""

from dataclasses import dataclass

from benchmarks.contest import Contest
from warpsim import Scene

LIFETIME_FRAMES = 10.0  # mean life: a tenth of the particles dies and is born in each frame


@dataclass(frozen=True)
class Case:
    """A scene of one system in its steady state, and how many frames lead to that."""

    name: str
    what: str
    scene: Scene
    warmup_frames: int


def million(count: int) -> Case:
    """The main case: `count` live particles, five primitives (two Lamb-Oseen), drag, gravity, 4 substeps, 10 % births and deaths."""
    fps = 60
    scene = {
        "name": f"{count} particles",
        "seed": 1,
        "time": {"fps": fps, "substeps": 4, "duration": 60.0},
        "gravity": [0, -9.81, 0],
        "flow": [
            {"type": "uniform", "velocity": [0.4, 0.8, 0]},
            {"type": "source", "center": [0, 0, 0], "axis": [0, 1, 0], "rate": 0.5},
            {"type": "vortex", "center": [1, 0, 0], "axis": [0, 1, 0], "circulation": 3.0, "core": {"model": "lamb_oseen", "radius": 0.3}},
            {
                "type": "vortex",
                "center": [-1, 0, 0],
                "axis": [0, 0, 1],
                "circulation": -2.0,
                "core": {"model": "lamb_oseen", "radius": 0.2},
            },
            {"type": "doublet", "center": [0, 1, 0], "axis": [0, 0, 1], "direction": [1, 0, 0], "strength": 0.1},
        ],
        "systems": {
            "dust": {
                "type": "particles",
                "capacity": count + count // 4,
                "coupling": {"alpha": 2.0e-3},
                "emitters": [
                    {
                        "shape": {"type": "box", "center": [0, 1, 0], "size": [2, 2, 2]},
                        "rate": count * fps / LIFETIME_FRAMES,
                        "velocity": {"direction": [0, 1, 0], "cone": 30, "speed": {"mean": 1.0, "spread": 0.5}},
                        "lifetime": {"mean": LIFETIME_FRAMES / fps, "spread": 0.5 * LIFETIME_FRAMES / fps},
                    }
                ],
            }
        },
    }
    what = f"{count:,} particles, 5 primitives (2 Lamb-Oseen), drag, gravity, 4 substeps, 10 % born and dying per frame"
    return Case("million", what, Scene.model_validate(scene), warmup_frames=int(2 * LIFETIME_FRAMES))


def drift(count: int, substeps: int = 4) -> Scene:
    """Particles of which none is born or dies: what is read and written is their state, once a frame."""
    vortex = {"type": "vortex", "center": [0, 0, 0], "axis": [0, 1, 0], "circulation": 1.0, "core": {"model": "lamb_oseen", "radius": 0.3}}
    emitter = {"shape": {"type": "box", "size": [2, 2, 2]}, "burst": {"count": count}, "lifetime": 1e6}
    system = {"type": "particles", "capacity": count, "coupling": {"alpha": 2.0e-3}, "emitters": [emitter]}
    scene = {
        "name": "drift",
        "time": {"fps": 60, "substeps": substeps},
        "gravity": [0, -9.81, 0],
        "flow": [vortex],
        "systems": {"dust": system},
    }
    return Scene.model_validate(scene)


def sparks(count: int) -> Case:
    """A small scene: what a user waits for is overhead, not arithmetic."""
    lifetime = 2.0
    scene = {
        "name": f"{count} sparks",
        "seed": 1,
        "time": {"fps": 60, "substeps": 4, "duration": 60.0},
        "flow": [
            {"type": "uniform", "velocity": [0.4, 1.5, 0]},
            {"type": "vortex", "center": [0, 0, 0], "axis": [0, 1, 0], "circulation": 1.0, "core": {"model": "lamb_oseen", "radius": 0.1}},
        ],
        "systems": {
            "sparks": {
                "type": "particles",
                "capacity": 2 * count,
                "coupling": {"alpha": 5.0e-3},
                "emitters": [
                    {
                        "shape": {"type": "disc", "center": [0, 0, 0], "normal": [0, 1, 0], "radius": 0.3},
                        "rate": {"mean": count / lifetime, "spread": 0.2 * count / lifetime},
                        "velocity": {"direction": [0, 1, 0], "cone": 20, "speed": {"mean": 2.0, "spread": 0.5}},
                        "lifetime": {"mean": lifetime, "spread": 0.5},
                    }
                ],
            }
        },
    }
    what = f"{count:,} live sparks, 2 primitives, drag, gravity, 4 substeps"
    return Case("sparks", what, Scene.model_validate(scene), warmup_frames=int(1.5 * lifetime * 60))


def flag() -> Case:
    """A flag of the size of the shipped one, in gusts, at the 16 substeps that its springs stand."""
    scene = {
        "name": "flag",
        "time": {"fps": 60, "substeps": 16, "duration": 60.0},
        "flow": [{"type": "uniform", "velocity": [{"expression": "7 + 2*sin(1.1*t)"}, 0, {"expression": "1.5*sin(2.3*t)"}]}],
        "systems": {
            "flag": {
                "type": "cloth",
                "resolution": [61, 41],
                "corner": [0, 3.1, 0],
                "edges": [[1.8, 0, 0], [0, -1.2, 0]],
                "density": 0.15,
                "structural": {"stiffness": 30, "damping": 0.004},
                "shear": {"stiffness": 15, "damping": 0.002},
                "bend": {"stiffness": 1},
                "air": 0.9,
                "pins": ["left"],
            }
        },
    }
    what = "a flag of 61 x 41 points in gusts, structural, shear and bend springs, air, 16 substeps"
    return Case("flag", what, Scene.model_validate(scene), warmup_frames=120)


def rows(quick: bool) -> list[Contest]:
    """What is small enough to run many times faster than the clock on the wall."""
    small, cloth = sparks(2_000), flag()
    return [
        Contest(
            "sparks", small.what, small.scene, 2_000, "spark", warmup=30 if quick else small.warmup_frames, cores=None, times_real=200.0
        ),
        Contest(
            "flag", cloth.what, cloth.scene, 61 * 41, "vertex", warmup=30 if quick else cloth.warmup_frames, cores=None, times_real=50.0
        ),
    ]
