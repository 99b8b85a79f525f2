"""Stability: the longest substep that a network stands, from its own points and springs, before anything has moved.

Symbols: W bounds ω², the eigenvalues of M⁻¹K, and G those of M⁻¹C; n̂ a spring's direction at the start, l its length, r its rest
length. Of Σ_s k (n̂·(x_i − x_j))² no spring gives more than 2k ((n̂·x_i)² + (n̂·x_j)²), so that W = max_i 2‖Σ k n̂ n̂ᵀ‖/m_i (Gershgorin's
circles, by points); a spring to a pin counts once. A stretched spring also pulls sideways, by k (1 − r/l).
Of the hinges of cloth no row of Σ k w wᵀ adds up to more than 16 (k_along + k_down + k_across); rims have less mass and fewer hinges.

What a method stands is asked of it for every oscillator with ω² <= W and damping γ <= G (amplification.py): the modes of a network
have Rayleigh quotients in there. Of the symplectic ones a mode stays iff h² ω² + 2 h γ < 4, with the springs' γ and, where it is not
split off, the air's.  Source: characteristic polynomial of one step.
"""

import math
from typing import NamedTuple

import numpy as np

from warpsim.amplification import GROWING, STAGED, largest_growth
from warpsim.muscles import shortest_factors
from warpsim.networks import Net, hinge_numbers, looseness, network_of, point_masses, spring_numbers
from warpsim.scene.pacing import MOST_SUBSTEPS
from warpsim.scene.springs import Network

MARGIN = 0.9  # of the longest substep that `auto` takes: a network that moves has other directions than at its start
UNBOUNDED = {"implicit_euler": 4, "xpbd": 16}  # solvers whose springs stand any substep, and how many `auto` takes per frame at least
SYMPLECTIC = ("semi_implicit_euler", "drift_kick", "verlet")
GROWERS = ("euler", *GROWING)
GROWTH = 0.01  # [1/s]: by which what swings undamped may grow with one of these, where no substep keeps it
SHARES = np.linspace(1.0 / 16.0, 1.0, 16)  # of the largest ω at which oscillators are tried


class Loads(NamedTuple):
    """What a network asks of a method."""

    stiffness: float
    """W, bounds ω² of every mode [1/s²]."""
    damping: float
    """G, bounds γ of every mode, by its springs [1/s]."""
    least_damping: float
    """β: every mode has γ >= β ω² [s]."""
    air: float
    """Rate at which velocities across a surface die away [1/s]."""
    drag: tuple[float, float]
    """Smallest and largest rate at which velocities of points die away, solved exactly [1/s]."""
    water: float = 0.0
    """Rate at which a fluid slows facets, of which a step takes 1 − e^(−rate h) as the springs pull [1/s]."""


class Advice(NamedTuple):
    """What a network stands."""

    longest: float
    """Substep up to which it is stable for sure [s]; infinite without springs, 0 where no substep is short enough."""
    least: int
    """Substeps per frame with which it is; 0 where as many as a frame may have are not enough."""
    chosen: int
    """Substeps per frame that the scene asks for, or that `auto` chooses."""
    solver: str
    """By which method."""
    excess: float = 0.0
    """How much further than by Hooke's law the springs give way with the chosen substeps, at most, as a share: by xpbd alone."""

    @property
    def sufficient(self) -> bool:
        """Whether the chosen substeps are enough for sure."""
        return 0 < self.least <= self.chosen

    def __str__(self) -> str:
        """Say it in words."""
        if self.least == 0 and self.solver in GROWERS:
            return f"with {self.solver} whatever swings grows at any substep: take semi_implicit_euler, drift_kick or verlet"
        if self.least == 0:
            return f"stands {self.longest:.3g} s at most, which is shorter than any substep: weaker springs, more mass, or implicit_euler"
        if self.longest == math.inf:
            return f"stable with any substeps; it has {self.chosen}{self._yielding}"
        words = f"with {self.solver} what swings grows by less than 1 % a second" if self.solver in GROWERS else "stable for sure"
        return f"{words} from {self.least} substeps per frame on, of {self.longest:.3g} s at most; it has {self.chosen}{self._yielding}"

    @property
    def _yielding(self) -> str:
        if self.excess < 0.05:
            return ""
        enough = math.ceil(self.chosen * math.sqrt(self.excess / 0.05))
        return f", with which springs give way up to {1.0 + self.excess:.3g} times as far as by Hooke's law ({enough}: 1.05)"


def advice_for(spec, scene, net: Net) -> Advice:
    """Return the advice for a network of a scene."""
    longest, frame, asked = longest_substep(spec, net), 1.0 / scene.time.fps, spec.substeps or scene.time.substeps
    least = max(1, math.ceil(frame / longest * (1.0 - 1e-9)))
    chosen = max(UNBOUNDED.get(spec.solver, 1), math.ceil(frame / (MARGIN * longest))) if asked == "auto" else asked
    excess = yielding(spec, net, frame / chosen) if spec.solver == "xpbd" else 0.0
    return Advice(longest, least if least <= MOST_SUBSTEPS else 0, chosen, spec.solver, excess)


def yielding(spec, net: Net, h: float) -> float:
    """Return how much further than by Hooke's law a spring gives way under xpbd, at most, as a share of its stretch.

    What a color has put right the next one moves, by h² w times its own pull: of two springs in a row one has k h² (w_i + w_j) too much,
    and together they have half of that. n passes leave an n-th of it, or less.
    """
    weight = 1.0 / point_masses(spec, net)
    weight[spec.pinned(spec.pins)] = 0.0
    stiffness = spring_numbers(spec, net)[0]
    return float((0.5 * stiffness * h * h * weight[net.springs].sum(axis=1)).max(initial=0.0)) / (spec.iterations or 1)


def scene_advice(scene) -> dict[str, Advice]:
    """Return the advice for every network of a scene, by name. Raises SceneError for a mesh that cannot be used."""
    networks = {name: spec for name, spec in scene.systems.items() if isinstance(spec, Network)}
    return {name: advice_for(spec, scene, network_of(spec, f"systems.{name}")) for name, spec in networks.items()}


def longest_substep(spec, net: Net) -> float:
    """Return the substep up to which a network is stable for sure with its solver [s]; with GROWERS, grows no faster than GROWTH."""
    return longest_for(spec.solver, network_loads(spec, net))


def longest_for(solver: str, loads: Loads) -> float:
    """Return the substep up to which a method stands these loads [s]."""
    fastest = max(math.sqrt(loads.stiffness), loads.damping + (loads.air if solver in STAGED else 0.0))
    if fastest == 0.0:
        return math.inf
    if solver == "euler":
        swinging = loads.least_damping + (loads.drag[0] + 2.0 * GROWTH) / loads.stiffness if loads.stiffness else math.inf
        return min(swinging, 2.0 / max(loads.damping + loads.air, 1e-300))
    holds = _staged_holds if solver in STAGED else _symplectic_holds
    low, high = 0.1 / fastest, 32.0 / fastest
    while low * fastest > 1e-9 and not holds(solver, loads, low):
        low, high = 0.1 * low, low
    while high > low * (1.0 + 1e-5):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if holds(solver, loads, middle) else (low, middle)
    return low


def _symplectic_holds(solver: str, loads: Loads, h: float) -> bool:
    """Return whether a step of h keeps every mode. Verlet splits the air off (Strang); drift_kick's springs come after the drag."""
    stands = 2.0 + 2.0 * math.exp(-loads.drag[1] * h) if solver == "drift_kick" else 4.0
    decay = -2.0 * math.expm1(-loads.water * h) - (0.0 if solver == "verlet" else 2.0 * math.expm1(-loads.air * h))
    return h * h * loads.stiffness + 2.0 * h * loads.damping + decay <= stands


def _staged_holds(solver: str, loads: Loads, h: float) -> bool:
    """Return whether a step of h keeps every oscillator that the loads allow."""
    drags = np.linspace(*loads.drag, 3 if loads.drag[1] > loads.drag[0] else 1) * h
    a = h * h * loads.stiffness * SHARES**2
    most = h * (loads.damping + loads.air)
    least = np.minimum(loads.least_damping / h * a, most)
    shares = np.linspace(0.0 if loads.stiffness else 0.25, 1.0, 4)[:, None]
    g = least + (most - least) * shares
    a, g, z = (array.reshape(-1) for array in np.broadcast_arrays(a, g[None], drags[:, None, None]))
    return largest_growth(solver, a, g, z) <= 1.0 + 1e-9 + (GROWTH * h if solver in GROWERS else 0.0)


def network_loads(spec, net: Net) -> Loads:
    """Return what a network asks of a method, at its start."""
    stiffness, damping, rest = spring_numbers(spec, net)
    if getattr(spec, "muscles", ()):
        rest = rest * shortest_factors(spec, net)
    mass, held = point_masses(spec, net), np.zeros(len(net.points), bool)
    held[spec.pinned(spec.pins)] = True
    length = np.linalg.norm(net.points[net.springs[:, 1]] - net.points[net.springs[:, 0]], axis=1)
    pulls = (stiffness > 0.0) & ~held[net.springs].all(axis=1)
    least = float((damping[pulls] / stiffness[pulls]).min(initial=np.inf)) if pulls.any() else 0.0
    if (pulls & (length > rest * (1.0 + 1e-9))).any():
        least = 0.0  # nothing damps what a stretched spring does sideways
    alpha = getattr(spec, "drag", 0.0) or getattr(spec.coupling, "alpha", 0.0)
    drag = (alpha + 6.0 * math.pi * spec.radius * getattr(spec.coupling, "viscosity", 0.0)) / mass[~held]
    air = spec.air / spec.density if spec.type == "cloth" else 0.0
    hinges, resisting = hinge_numbers(spec)
    if spec.solver in UNBOUNDED:
        stiffness, damping = 0.0 * stiffness, 0.0 * damping  # what the solver itself answers
    least = min([least, *(resisting[hinges > 0.0] / hinges[hinges > 0.0])])
    strong = bound(net, stiffness, rest, mass, held) + float(16.0 * hinges.sum() / mass.max())
    damped = bound(net, damping, None, mass, held) + float(16.0 * resisting.sum() / mass.max())
    water = water_rate(getattr(spec, "water", None) or 0.0, net, np.where(held, 0.0, 1.0 / mass))
    if spec.solver in STAGED or spec.solver == "euler":
        air, water = air + water, 0.0
    between = (float(drag.min(initial=np.inf)), float(drag.max())) if drag.size else (0.0, 0.0)
    return Loads(strong, damped, least, air, between, water)


def water_rate(water: float, net: Net, inverse_mass: np.ndarray) -> float:
    """Return a bound of the rate at which a fluid slows a surface [1/s]: the largest κ of kernels/facets.py, at the start."""
    if not water:
        return 0.0
    a, b, c, d = net.points[np.where(net.facets < 0, net.facets[:, [2]], net.facets)].swapaxes(0, 1)
    area = 0.5 * np.linalg.norm(np.cross(c - a, d - b), axis=1)
    return float((water * area * looseness(net, inverse_mass)).max(initial=0.0))


def bound(net: Net, coefficient: np.ndarray, rest: np.ndarray | None, mass: np.ndarray, held: np.ndarray) -> float:
    """Return max_i 2‖Σ k n̂ n̂ᵀ‖/m_i over the free points [1/s² or 1/s]; with rest lengths, stretched springs pull sideways too."""
    i, j = net.springs.T
    d = net.points[j] - net.points[i]
    length = np.linalg.norm(d, axis=1)
    n = d / np.maximum(length, 1e-30)[:, None]
    along, aside = coefficient, np.zeros(len(length))
    if rest is not None:
        aside = coefficient * np.where(length > 0.0, np.clip(1.0 - rest / np.maximum(length, 1e-30), 0.0, 1.0), 1.0)
        along = coefficient - aside
    counted = [np.where(held[there], 1.0, 2.0) for there in (j, i)]
    total = np.empty((len(net.points), 3, 3))
    for a, b in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
        pull = along * n[:, a] * n[:, b] + (aside if a == b else 0.0)
        ends = (np.bincount(here, pull * times, len(net.points)) for here, times in zip((i, j), counted, strict=True))
        total[:, a, b] = total[:, b, a] = sum(ends)
    free = ~held
    return float((np.linalg.eigvalsh(total[free])[:, -1] / mass[free]).max(initial=0.0))
