"""Stability: the longest substep that a network stands, from its own points and springs, before anything has moved.

Symbols: W bounds ω², the eigenvalues of M⁻¹K, and G those of M⁻¹C; n̂ a spring's direction at the start, l its length, r its rest
length. Of Σ_s k (n̂·(x_i − x_j))² no spring gives more than 2k ((n̂·x_i)² + (n̂·x_j)²), so that W = max_i 2‖Σ k n̂ n̂ᵀ‖/m_i (Gershgorin's
circles, by points); a spring to a pin counts once. A stretched spring also pulls sideways, by k (1 − r/l).
Of the hinges of cloth no row of Σ k w wᵀ adds up to more than 16 (k_along + k_down + k_across); rims have less mass and fewer hinges.
A mode of a symplectic method with explicit damping γ stays iff h² ω² + 2 h γ < 4.  Source: characteristic polynomial of one step.
"""

import math
from typing import NamedTuple

import numpy as np

from warpsim.networks import Net, hinge_numbers, network_of, point_masses, spring_numbers
from warpsim.scene import SceneError
from warpsim.scene.pacing import MOST_SUBSTEPS
from warpsim.scene.problems import Problem
from warpsim.scene.springs import Network

MARGIN = 0.9  # of the longest substep that `auto` takes: a network that moves has other directions than at its start
UNBOUNDED = {"implicit_euler": 4}  # solvers that stand any substep, and how many `auto` takes per frame
SYMPLECTIC = ("semi_implicit_euler", "drift_kick", "verlet")


class Advice(NamedTuple):
    """What a network stands."""

    longest: float
    """Substep up to which it is stable for sure [s]; infinite without springs, 0 where no substep is short enough."""
    least: int
    """Substeps per frame with which it is; 0 where none are enough."""
    chosen: int
    """Substeps per frame that the scene asks for, or that `auto` chooses."""

    @property
    def sufficient(self) -> bool:
        """Whether the chosen substeps are enough for sure."""
        return 0 < self.least <= self.chosen

    def __str__(self) -> str:
        """Say it in words."""
        if self.least == 0:
            return "with euler whatever swings grows at any substep: take semi_implicit_euler, drift_kick or verlet"
        if self.longest == math.inf:
            return f"stable with any substeps; it has {self.chosen}"
        return f"stable for sure from {self.least} substeps per frame on, of {self.longest:.3g} s at most; it has {self.chosen}"


def advice_for(spec, scene, net: Net) -> Advice:
    """Return the advice for a network of a scene."""
    longest, frame, asked = longest_substep(spec, net), 1.0 / scene.time.fps, spec.substeps or scene.time.substeps
    least = 0 if longest == 0.0 else max(1, math.ceil(frame / longest * (1.0 - 1e-9)))
    chosen = asked
    if asked == "auto":
        chosen = UNBOUNDED.get(spec.solver) or max(1, math.ceil(frame / (MARGIN * longest)))
    return Advice(longest, least, chosen)


def checked_advice(name: str, spec, scene, net: Net) -> Advice:
    """Return the advice. Raises SceneError where `auto` would need more substeps than a frame may have."""
    advice = advice_for(spec, scene, net)
    if advice.chosen > MOST_SUBSTEPS:
        message = f"{name} needs {advice.chosen} substeps per frame, and a frame has at most {MOST_SUBSTEPS}: weaker springs, more mass"
        raise SceneError([Problem(message, path=f"systems.{name}.substeps")])
    return advice


def scene_advice(scene) -> dict[str, Advice]:
    """Return the advice for every network of a scene, by name. Raises SceneError for a mesh that cannot be used."""
    networks = {name: spec for name, spec in scene.systems.items() if isinstance(spec, Network)}
    return {name: advice_for(spec, scene, network_of(spec, f"systems.{name}")) for name, spec in networks.items()}


def longest_substep(spec, net: Net) -> float:
    """Return the substep up to which a network is stable for sure with its solver [s]: 0 for euler, by which what swings always grows."""
    stiffness, damping, rest = spring_numbers(spec, net)
    mass, held = point_masses(spec, net), np.zeros(len(net.points), bool)
    held[spec.pinned(spec.pins)] = True
    largest = bound(net, stiffness, rest, mass, held)
    resistance = bound(net, damping, None, mass, held)
    bend, resist = (16.0 * numbers.sum() / mass.max() for numbers in hinge_numbers(spec))
    largest, resistance = largest + bend, resistance + resist
    if largest == 0.0 and resistance == 0.0:
        return math.inf
    if spec.solver in UNBOUNDED:
        return math.inf
    if spec.solver not in SYMPLECTIC:
        return 0.0
    return 4.0 / (resistance + math.sqrt(resistance**2 + 4.0 * largest))  # the root of h² W + 2 h G = 4


def bound(net: Net, coefficient: np.ndarray, rest: np.ndarray | None, mass: np.ndarray, held: np.ndarray) -> float:
    """Return max_i 2‖Σ k n̂ n̂ᵀ‖/m_i over the free points [1/s² or 1/s]; with rest lengths, stretched springs pull sideways too."""
    i, j = net.springs.T
    d = net.points[j] - net.points[i]
    length = np.linalg.norm(d, axis=1)
    n = d / np.maximum(length, 1e-30)[:, None]
    pull = coefficient[:, None, None] * n[:, :, None] * n[:, None, :]
    if rest is not None:
        aside = np.where(length > 0.0, np.clip(1.0 - rest / np.maximum(length, 1e-30), 0.0, 1.0), 1.0)
        pull += (coefficient * aside)[:, None, None] * (np.eye(3) - n[:, :, None] * n[:, None, :])
    total = np.zeros((len(net.points), 3, 3))
    for here, there in ((i, j), (j, i)):
        np.add.at(total, here, pull * np.where(held[there], 1.0, 2.0)[:, None, None])
    free = ~held
    return float((np.linalg.eigvalsh(total[free])[:, -1] / mass[free]).max(initial=0.0))
