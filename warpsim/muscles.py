"""Muscles: which springs follow which factor of their rest lengths, worked out from a network before it moves."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from warpsim.networks import Net
from warpsim.scene import SceneError
from warpsim.scene.muscles import unjoined
from warpsim.scene.problems import Problem
from warpsim.scene.strengths import Formula, Keyframes, Sine


@dataclass(frozen=True, eq=False)
class Course:
    """The springs of one muscle."""

    springs: np.ndarray
    """int (n,): their numbers."""
    way: np.ndarray
    """float64 (n,): from where the wave begins to the middle of each [m]."""
    amplitude: np.ndarray
    """float64 (n,): of the wave at each [1]; 0 without a wave."""


def courses_of(spec, net: Net) -> list[Course]:
    """Return the springs of every muscle of a network. Raises SceneError where a chain leaves the springs, or two muscles share one."""
    number = {frozenset(pair): k for k, pair in enumerate(net.springs.tolist())}
    courses, owner, wrong = [], {}, []
    for k, muscle in enumerate(spec.muscles):
        path = f"{net.where}.muscles.{k}"
        try:
            course = _course(muscle, spec, net, number)
        except LookupError as error:
            wrong.append(Problem(error.args[0], path=f"{path}.chain"))
            continue
        taken = [one for one in course.springs.tolist() if owner.setdefault(one, k) != k]
        if taken:
            i, j = net.springs[taken[0]].tolist()
            wrong.append(Problem(f"the spring of points {i} and {j} is moved by muscles.{owner[taken[0]]} already", path=path))
        elif len(set(course.springs.tolist())) < len(course.springs):
            wrong.append(Problem("a spring is named twice", path=path))
        courses.append(course)
    if wrong:
        raise SceneError(wrong)
    return courses


def _course(muscle, spec, net: Net, number: dict[frozenset, int]) -> Course:
    """Return the springs of one muscle. Raises LookupError in words where points of a chain are not joined, or its part is empty."""
    pieces = [_along(spec.chain_points(name), muscle, net, number) for name in muscle.chains]
    if not muscle.chains:
        chosen = muscle.springs
        if isinstance(chosen, str):
            chosen = range(len(net.springs)) if chosen == "all" else spec.generator.spring_group(chosen)
        springs = np.array(chosen, int)
        pieces = [(springs, np.zeros(len(springs)), np.zeros(len(springs)))]
    springs, way, share = (np.concatenate(arrays) for arrays in zip(*pieces, strict=True))
    if muscle.wave and muscle.wave.direction is not None:
        forward = np.array(muscle.wave.direction) / np.linalg.norm(muscle.wave.direction)
        place = net.points @ forward
        way = place[net.springs[springs]].mean(axis=1) - place.min()
        share = way / max(np.ptp(place), 1e-30)
    first, last = np.broadcast_to(muscle.wave.amplitude if muscle.wave else 0.0, 2)
    return Course(springs, way, first + (last - first) * share)


def _along(line, muscle, net: Net, number: dict[frozenset, int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the springs along a chain that lie in the muscle's part, the way to the middle of each [m], and its share of the whole."""
    loose = [pair for pair in pairwise(line) if frozenset(pair) not in number]
    if loose:
        raise LookupError(unjoined(*loose[0]))
    springs = np.array([number[frozenset(pair)] for pair in pairwise(line)], int)
    length = np.linalg.norm(net.points[net.springs[springs, 1]] - net.points[net.springs[springs, 0]], axis=1)
    middle = np.cumsum(length) - 0.5 * length
    share = middle / max(length.sum(), 1e-30)
    chosen = (share >= muscle.part[0]) & (share <= muscle.part[1])
    if not chosen.any():
        raise LookupError("no spring of the chain has its middle in this part of it")
    return springs[chosen], middle[chosen], share[chosen]


def shortest_factors(spec, net: Net) -> np.ndarray:
    """Return the least factor that the rest length of every spring can have, float64 (m,); 0 where an expression decides."""
    least = np.ones(len(net.springs))
    for muscle, course in zip(spec.muscles, courses_of(spec, net), strict=True):
        swing = -np.abs(course.amplitude) if muscle.wave else np.full(len(course.springs), _least(muscle.rest) - 1.0)
        least[course.springs] = np.clip(1.0 + _most(muscle.activation) * swing, 0.0, 1.0)
    return least


def _least(strength) -> float:
    """Return the least value that a strength can have, 0 where that is not known."""
    if isinstance(strength, Keyframes):
        return min(value for _, value in strength.keyframes)
    if isinstance(strength, Sine):
        return max(strength.sine.mean - abs(strength.sine.amplitude), 0.0)
    return 0.0 if isinstance(strength, Formula) else strength


def _most(strength) -> float:
    """Return the largest value that a strength can have; endless where that is not known."""
    if isinstance(strength, Keyframes):
        return max(value for _, value in strength.keyframes)
    if isinstance(strength, Sine):
        return strength.sine.mean + abs(strength.sine.amplitude)
    return 1e12 if isinstance(strength, Formula) else strength
