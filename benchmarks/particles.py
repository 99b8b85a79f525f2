"""Uncoupled particles: the whole frame, births and deaths included, in turns with Numba and Taichi doing the same to the same particles."""

from functools import partial

from benchmarks.cases import million
from benchmarks.contest import Claim, Contest, Entrant
from benchmarks.measure import Stepped
from benchmarks.particle_peers import distance, start_of
from warpsim import Simulation
from warpsim.launch import available_cores

MOST_APART = 1e-5  # [m], in the mean
WHY = "libm's exponential, fused and reassociated sums, 20 substeps past two vortices and a doublet; 1e-7 as a rule, one at an axis a meter"


def rows(quick: bool) -> list[Contest]:
    """The rows of particles."""
    counts = {"particles-1m": 3_000, "particles-4m": 5_000} if quick else {"particles-1m": 1_000_000, "particles-4m": 4_000_000}
    return [particles(name, count) for name, count in counts.items()]


def particles(name: str, count: int, plain: float | None = 12.0) -> Contest:
    """So many particles beside the same in Numba, as people write it and blocked by hand as ours are, and in Taichi."""
    case, cores = million(count), available_cores()
    ways = {"Numba prange": numba_dust, "Numba, blocked by hand": blocked_dust}
    entrants = [Entrant(label, n, partial(make, threads=n), "numba") for label, make in ways.items() for n in sorted({1, cores})]
    entrants.append(Entrant("Taichi", cores, partial(taichi_dust, threads=cores), "taichi"))
    return Contest(
        name=name,
        work=case.what,
        scene=case.scene,
        items=count,
        warmup=case.warmup_frames,
        entrants=entrants,
        compare=distance,
        most=MOST_APART,
        why=WHY,
        claims=[Claim(("Numba prange", "Taichi"), 4.0), Claim(("Numba, blocked by hand",), 1.0)],
        plain=plain,
    )


def numba_dust(run: Simulation, threads: int) -> Stepped:
    """The peer in Numba as people write it."""
    from benchmarks.particle_numba import Dust

    return Dust(start_of(run), threads)


def blocked_dust(run: Simulation, threads: int) -> Stepped:
    """The peer in Numba, blocked by hand."""
    from benchmarks.particle_blocks import BlockedDust

    return BlockedDust(start_of(run), threads)


def taichi_dust(run: Simulation, threads: int) -> Stepped:
    """The peer in Taichi."""
    from benchmarks.particle_taichi import taichi_dust as make

    return make(start_of(run), threads)
