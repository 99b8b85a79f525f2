"""Memory of a process, beside what `info` tells: python -m benchmarks.memory [--share 0.1] [--json]"""

import argparse
import copy
import ctypes
import gc
import json
from multiprocessing import get_context

FRAMES = 70  # after which a state has been kept besides the first
COUNT = 1_000_000


def documents(share: float) -> dict[str, tuple[dict, dict, int]]:
    """Return by what is counted: a scene, the keys that make it small, and how many there are."""
    count, side = round(COUNT * share), round(256 * share**0.5)
    emitter = {"shape": {"type": "box", "size": [1, 1, 1]}, "rate": 2 * count, "lifetime": {"mean": 0.6, "spread": 0.2}}
    emitter["velocity"] = {"cone": 20, "speed": 1}
    particles = {"type": "particles", "capacity": count, "emitters": [emitter]}
    half = 0.5 * (count * 4.19 / 24) ** (1 / 3)  # 24 neighbors within a radius of 1 m
    domain = {"min": [-half] * 3, "max": [half] * 3, "boundary": "periodic"}
    flock = {"type": "flock", "count": count, "domain": domain, "perception": {"radius": 1.0}, "speed": [1, 2]}
    cloth = {"type": "cloth", "resolution": [side, side], "edges": [[0.1 * side, 0, 0], [0, 0, 0.1 * side]], "pins": ["corners"]}
    cloth |= {kind: {"stiffness": 1.0} for kind in ("structural", "shear", "bend")}
    return {
        "particle": ({"name": "particles", "systems": {"s": particles}}, {"capacity": 64}, count),
        "boid": ({"name": "boids", "systems": {"s": flock}}, {"count": 64}, count),
        "vertex": ({"name": "cloth", "systems": {"s": cloth}}, {"resolution": [8, 8]}, side * side),
    }


def resident() -> int:
    """Return the bytes that this process has written to, not those of its files, once it has given back what it can."""
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    with open("/proc/self/status") as lines:
        return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("RssAnon"))


def measure(what: str, document: dict, small: dict, count: int) -> dict:
    """Return bytes of one: told, and taken by a simulation that runs; a small one before has loaded everything else."""
    from warpsim import Scene, Simulation
    from warpsim.footprint import KEPT
    from warpsim.memory import memory_of

    tiny = copy.deepcopy(document)
    tiny["systems"]["s"] |= small
    first = Simulation(Scene.model_validate(tiny), device="cpu")
    first.step_frame()
    del first
    scene = Scene.model_validate(document)
    told = memory_of(scene)["s"]
    before = resident()
    simulation = Simulation(scene, device="cpu")
    emitted = what == "particle"  # else frame 0 has as much to keep as any later one
    for _ in range(FRAMES if emitted else 1):
        simulation.step_frame()
    unkept = told.host[KEPT] - (told.state if emitted else told.first)
    taken = (resident() - before) / count
    return {"what": what, "count": count, "told": round((told.total - unkept) / count, 1), "taken": round(taken, 1)} | {
        "parts": {name: round(size / count, 1) for name, size in told.parts.items()}
    }


def main() -> None:
    """Print a row for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--share", type=float, default=1.0, help="of a million, and of 256 x 256")
    parser.add_argument("--json", action="store_true", help="a line of JSON each")
    arguments = parser.parse_args()
    import warpsim.simulation  # noqa: F401 — once, before the processes part

    for what, case in documents(arguments.share).items():
        with get_context("fork").Pool(1) as alone:  # a process each: what another has given back would be taken again
            row = alone.apply(measure, (what, *case))
        count = row["count"]
        if arguments.json:
            print(json.dumps(row), flush=True)
            continue
        parts = ", ".join(f"{name} {size:g}" for name, size in row["parts"].items())
        print(f"{count} of {what}: {row['taken']:g} bytes each, told {row['told']:g} ({parts})", flush=True)


if __name__ == "__main__":
    main()
