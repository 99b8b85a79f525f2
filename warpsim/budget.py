"""Budget: whether a frame has room for the substeps that a network needs, and else by how much which of its numbers is too large.

A network with all stiffness and damping divided by f moves like one with all masses times f, so that one factor serves both.
"""

import math
from collections.abc import Callable

from warpsim.networks import KINDS as SPRING_KINDS
from warpsim.networks import Net
from warpsim.scene import SceneError
from warpsim.scene.pacing import MOST_SUBSTEPS
from warpsim.scene.problems import Problem
from warpsim.scene.springs import Network
from warpsim.stability import GROWERS, MARGIN, Advice, advice_for, longest_substep

MOST_ROUNDS = 40  # of the search: each takes at least the root of what is left, so that ten are enough for nearly all


def checked_advice(name: str, spec, scene, net: Net) -> Advice:
    """Return the advice. Raises SceneError where `auto` would need more substeps than a frame may have."""
    advice = advice_for(spec, scene, net)
    if advice.chosen > MOST_SUBSTEPS:
        path, words = excess(spec, net, advice.chosen, scene.time.fps)
        raise SceneError([Problem(f"{name} {words}", path=f"systems.{name}.{path}")])
    return advice


def excess(spec: Network, net: Net, needed: int, fps: float) -> tuple[str, str]:
    """Return the path of the number of a network that is too large for any substeps that a frame may have, and by how much it is."""
    words = f"needs {needed} substeps per frame, and a frame has at most {MOST_SUBSTEPS}"
    if spec.solver in GROWERS:
        return "solver", f"{words}: with {spec.solver} whatever swings undamped grows (take another solver, or more damping)"
    wanted = 1.0 / (fps * MOST_SUBSTEPS * MARGIN)
    heavier = factor_for(wanted, net, lambda f: _heavier(spec, f))
    eased = next((key for key in _kinds_of(spec) if longest_substep(_eased(spec, key, math.inf), net) >= wanted), None)
    factor = heavier if eased is None else factor_for(wanted, net, lambda f: _eased(spec, eased, f))
    path, value, unit, alone = _largest(spec, eased or "stiffness")
    others = "" if alone else f", and the others like it {rounded(factor, math.ceil):g} times smaller too"
    changes = f"{path} may be {rounded(value / factor, math.floor):g} {unit} at most (it is {value:g}){others}"
    mass = f"{'density' if spec.type == 'cloth' else 'mass'} must be {rounded(heavier, math.ceil):g} times larger"
    return path, f"{words}: {changes}; or {mass}{'' if path.startswith('bending') else '; or solver: implicit_euler'}"


def rounded(value: float, to: Callable[[float], int]) -> float:
    """Return a positive number to three digits, rounded by math.floor or math.ceil."""
    digit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return to(value / digit) * digit


def factor_for(wanted: float, net: Net, changed: Callable[[float], Network]) -> float:
    """Return the factor at which a network, changed by it, stands substeps of `wanted` seconds: not less, and hardly more."""
    factor = 1.0
    for _ in range(MOST_ROUNDS):
        stands = longest_substep(changed(factor), net)
        if stands >= wanted:
            break
        factor *= max(wanted / stands, 1.001)
    return factor


def _heavier(spec: Network, factor: float) -> Network:
    if spec.type == "cloth":
        return spec.model_copy(update={"density": spec.density * factor})
    return spec.model_copy(update={"mass": tuple(m * factor for m in spec.mass) if isinstance(spec.mass, tuple) else spec.mass * factor})


def _kinds_of(spec: Network) -> tuple[str, ...]:
    """Return the kinds of numbers that alone may be too large, besides the stiffness of springs."""
    return ("bending.damping", "bending.stiffness", "damping") if spec.type == "cloth" and spec.bending else ("damping",)


def _eased(spec: Network, kind: str, factor: float) -> Network:
    """Return the network with all numbers of a kind divided by a factor."""
    key = kind.removeprefix("bending.")
    if spec.type != "cloth":
        value = spec.damping
        return spec.model_copy(update={key: tuple(c / factor for c in value) if isinstance(value, tuple) else value / factor})
    parts = {name: getattr(spec, name) for name in (SPRING_KINDS if kind == key else ("bending",))}
    return spec.model_copy(update={name: part.model_copy(update={key: getattr(part, key) / factor}) for name, part in parts.items()})


def _largest(spec: Network, kind: str) -> tuple[str, float, str, bool]:
    """Return path, value and unit of the largest number of a kind, and whether there is only one."""
    unit = {"stiffness": "N/m", "damping": "N s/m", "bending.stiffness": "N m", "bending.damping": "N m s"}[kind]
    if kind.startswith("bending"):
        return kind, getattr(spec.bending, kind.removeprefix("bending.")), unit, True
    values = [getattr(getattr(spec, name), kind) for name in SPRING_KINDS] if spec.type == "cloth" else getattr(spec, kind)
    if not isinstance(values, (list, tuple)):
        return kind, values, unit, True
    place = max(range(len(values)), key=values.__getitem__)
    path = f"{SPRING_KINDS[place]}.{kind}" if spec.type == "cloth" else f"{kind}.{place}"
    return path, values[place], unit, sum(value > 0.0 for value in values) == 1
