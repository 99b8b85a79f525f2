"""Flocks: the whole step with one core and all, in turns with Numba, Taichi and Warp's own hash grid doing the same to the same boids."""

import math
import sys
from statistics import median

import numpy as np

from benchmarks.flock_peers import HashGridFlock, Law, installed
from benchmarks.measure import Sample, Timing, Way, take_turns
from benchmarks.report import Report
from warpsim import Scene, Simulation
from warpsim.launch import available_cores

FPS = 60
SPEED = (0.5, 2.0)  # [m/s]
STRONGEST = 20.0  # [N]
WARMUP_FRAMES = 2
COMPARED_FRAMES = 5
MOST_APART = 1e-6  # [m], in the mean: a neighbor at the very edge of view is seen by one and not by the other, and moves a boid 1e-5 m
ROUNDING = 2.0**-23  # of the box's edge: what places are rounded to in a frame


def flock(count: int, neighbors: float, radius: float, view: float) -> Scene:
    """A box of boids, each with so many others within its radius [m], of which it sees those in its field of view [degrees]."""
    edge = radius * (count * 4.0 / 3.0 * math.pi / neighbors) ** (1.0 / 3.0)
    domain = {"min": [0, 0, 0], "max": [edge] * 3, "boundary": "contain"}
    system = {"type": "flock", "count": count, "domain": domain, "perception": {"radius": radius, "field_of_view": view}}
    system |= {"speed": list(SPEED), "max_force": STRONGEST}
    return Scene.model_validate({"name": "flock", "time": {"fps": FPS, "substeps": 1}, "systems": {"flock": system}})


def law_of(scene: Scene) -> Law:
    """Return what the peers are to do."""
    spec = scene.systems["flock"]
    cosine = math.cos(math.radians(0.5 * spec.perception.field_of_view))
    return Law(spec.perception.radius, cosine, STRONGEST, *SPEED, spec.domain.max[0], 1.0 / FPS)


def own_ways() -> list[Way]:
    """One core, and all."""
    cores = available_cores()
    return [Way("warpsim, 1 thread", 1), *([Way(f"warpsim, {cores} threads", cores)] if cores > 1 else [])]


def peers_of(run: Simulation) -> dict[Way, object]:
    """Make the peers that are installed, from the present state of a run."""
    frame, law, cores = run.frame()["flock"], law_of(run.scene), available_cores()
    x, v = np.array(frame.position), np.array(frame.velocity)
    peers = {Way("wp.HashGrid, plain kernel, 1 thread", 1, native=False): HashGridFlock(x, v, law)}
    if installed("numba"):
        from benchmarks import flock_numba

        for threads in sorted({1, cores}):
            label = f"Numba prange, {threads} thread{'s' * (threads > 1)}"
            peers[Way(label, threads, native=False)] = flock_numba.Flock(x, v, law, threads)
    if installed("taichi"):
        from benchmarks.flock_taichi import taichi_flock

        peers[Way(f"Taichi, {cores} threads", cores, native=False)] = taichi_flock(x, v, law, cores)
    return peers


def measure_flocks(sizes: tuple[int, ...], report: Report, rounds: int) -> None:
    """Tell of flocks of several sizes with 24 neighbors and a field of view, how the cost grows, and of the densest."""
    costs = {}
    for count in sizes:
        costs[count] = measure_flock(count, flock(count, 24.0, 1.0, 240.0), report, rounds, with_peers=count >= 100_000 or len(sizes) == 1)
    for way in own_ways():
        each = {count: work(times[way]).median / count for count, times in costs.items()}
        text = ", ".join(f"{1e9 * cost:.0f} ns ({count:,})" for count, cost in each.items())
        growth = max(each.values()) / min(each.values())
        report.fact("flocks", f"processor time per boid, {way.label}", f"{text}: within {growth:.2f}, to reach: 1.5", growth=growth)
    count = sizes[-1]
    measure_flock(count, flock(count, 4.0 / 3.0 * math.pi * 8.0, 2.0, 360.0), report, rounds, with_peers=False)


def measure_flock(count: int, scene: Scene, report: Report, rounds: int, with_peers: bool) -> dict[Way, Timing]:
    """Print the times of one flock, its phases and ratios; return the times."""
    runs = {way: way.build(scene, "cpu") for way in own_ways()}
    step_all(runs, WARMUP_FRAMES)
    peers = peers_of(next(iter(runs.values()))) if with_peers else {}
    step_all(runs | peers, COMPARED_FRAMES)
    compare(runs, peers)
    times = take_turns(runs | peers, rounds, lambda: None)
    met = float(next(iter(runs.values())).frame()["flock"].neighbors.mean())
    lines = []
    for way, timing in times.items():
        seconds = timing.seconds
        each = 1e9 * seconds.median / count
        cells = [way.label, f"{1e3 * seconds.median:.2f}", f"{seconds.spread:.0%}", f"{each:.0f}", f"{1e3 * work(timing).median:.2f}"]
        row = {"way": way.label, "boids": count, "seconds": seconds.median, "spread": seconds.spread, "work": work(timing).median}
        lines.append(([*cells, f"{timing.cores.median:.2f}"], row))
    perception = scene.systems["flock"].perception
    what = f"{count:,} boids that see {met:.1f} others within {perception.radius:g} m and {perception.field_of_view:g} degrees: whole steps"
    report.figures("flocks", what, ["", "ms", "spread", "ns/boid", "ms of processor", "cores got"], lines)
    tell_ratios(report, times)
    for way, run in runs.items():
        phases = phase_times(run, max(5, rounds // 2))
        text = ", ".join(f"{phase} {1e3 * seconds:.2f}" for phase, seconds in phases.items())
        report.fact("flocks", f"phases apart, {way.label}, ms", text, phases=phases)
    report.console.print()
    return times


def step_all(runs: dict[Way, object], frames: int) -> None:
    """Advance all alike."""
    for run in runs.values():
        for _ in range(frames):
            run.step_frame()


def compare(runs: dict[Way, Simulation], peers: dict[Way, object]) -> None:
    """Stop where hashes of ours differ, or where a peer's boids are elsewhere."""
    if len({run.state_hash() for run in runs.values()}) > 1:
        sys.exit("the ways do not agree: their state hashes differ")
    run = next(iter(runs.values()))
    ours, most = run.frame()["flock"].position, MOST_APART + ROUNDING * law_of(run.scene).edge
    for way, peer in peers.items():
        apart = float(np.linalg.norm(peer.position - ours, axis=1).mean())
        if not apart <= most:
            sys.exit(f"{way.label} is {apart:.1e} m away in the mean after {COMPARED_FRAMES} frames")


def work(timing: Timing) -> Sample:
    """Return how much processor time a frame took [s], all cores together: what other programs on the machine change least."""
    return Sample([seconds * cores for seconds, cores in zip(timing.seconds.values, timing.cores.values, strict=True)])


def tell_ratios(report: Report, times: dict[Way, Timing]) -> None:
    """Print how much longer each peer takes than we do with as many cores, and one core of ours than all."""
    natives = [way for way in times if way.native]
    for way in (way for way in times if not way.native):
        mine = next((own for own in natives if own.threads == way.threads), natives[0])
        starved = times[mine].starved(mine.threads) or times[way].starved(way.threads)
        report.ratio("flocks", f"{way.label} / {mine.label}", times[way].seconds.over(times[mine].seconds), 3.5, starved)
        label = f"{way.label} / {natives[0].label}, time of processors"
        report.ratio("flocks", label, work(times[way]).over(work(times[natives[0]])), 3.5)
    if len(natives) > 1:
        one, all_cores = (times[way] for way in natives)
        starved = all_cores.starved(natives[1].threads)
        report.ratio("flocks", f"{natives[0].label} / {natives[1].label}", one.seconds.over(all_cores.seconds), 1.5, starved)


def phase_times(run: Simulation, frames: int) -> dict[str, float]:
    """Return the median time of each phase [s], run one by one."""
    taken = [run.time_stages() for _ in range(frames)]
    return {phase: median(times[phase] for times in taken) for phase in taken[0]}
