"""Orders of convergence: one particle of a scene by every method at smaller and smaller steps, in float64 and, beside, in float32.

What passes for the exact path is one of fourth order with at most a quarter of the smallest step, in float64: no error that is shown is
smaller than its own, but for rk4's last one or two, and no order is fitted through errors that its rounding could reach.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import warp as wp

from warpsim.environment import pick
from warpsim.flow_formulas import FORMULAS
from warpsim.integrators import FIRST_ORDER_FORM, SECOND_ORDER_FORM
from warpsim.kernels.convergence import TRACES, Pull, Setting
from warpsim.kernels.forces import ATTRACTOR_LAWS
from warpsim.scene import Problem, Scene, SceneError
from warpsim.scene.expressions import PLACE, compile_expression
from warpsim.signals import SignalTable, strength_signals

wp.config.log_level = max(wp.config.log_level, wp.LOG_WARNING)  # as for a simulation: no banner and no line per module
FLOWS = ("expression", "uniform", *FORMULAS)
SHAPES = ("point", "disc", "sphere", "box")
FINER, FINEST = 4, 12_800  # steps of the exact path: so many times those of the smallest step, and at least so many
FITTED = 3  # rungs through which an order is fitted: the smallest steps above the floor of rounding


@dataclass(frozen=True)
class MethodErrors:
    """Largest distance from the exact path at each step, and the order that it shows; None where rounding or instability hides it."""

    solver: str
    theory: int
    order: float | None
    errors: tuple[float, ...]
    """In float64 [m]; inf where it left the finite world."""
    errors32: tuple[float, ...]
    """The same in float32, the precision of a run [m]."""


@dataclass(frozen=True)
class Study:
    """What every method makes of one system: steps [s] falling, errors [m]."""

    system: str
    form: str
    """first-order (tracers) or second-order."""
    duration: float
    """Of the path [s]: the scene's, or the particle's lifetime where that is shorter."""
    steps: tuple[float, ...]
    methods: tuple[MethodErrors, ...]


@dataclass(frozen=True)
class Path:
    """A path: position [m], velocity [m/s], (steps + 1, 3) each; the method's own estimates of each step's error [m, m/s]."""

    position: np.ndarray
    velocity: np.ndarray
    estimates: np.ndarray


class Experiment:
    """One particle of a system, alone in what it feels; with the mean of its first emitter's initial values, for as long.

    Raises SceneError where the scene has what float64 does not: see `unsuitable`.
    """

    def __init__(self, scene: Scene, system: str | None = None):
        self.system = system if system is not None else suitable_system(scene)
        problems = unsuitable(scene, self.system)
        if problems:
            raise SceneError(problems)
        self.spec = scene.systems[self.system]
        self.duration = min(scene.time.duration, self.spec.emitters[0].lifetime.mean)
        self.tracer = self.spec.coupling == "tracer"
        self.methods = FIRST_ORDER_FORM if self.tracer else SECOND_ORDER_FORM
        self._setting = setting(scene, self.spec)
        self.damped = self._setting.k > 0.0

    def path(self, solver: str, count: int, bits: int = 64) -> Path:
        """Follow the particle by a solver in so many equal steps."""
        position = wp.zeros(count + 1, dtype=wp.vec3d, device="cpu")
        velocity, errors = wp.zeros_like(position), wp.zeros(count + 1, dtype=wp.vec2d, device="cpu")
        kernel = TRACES[bits][self.methods[solver].name]
        wp.launch(kernel, 1, [0, self._setting, self.duration / count, position, velocity, errors], device="cpu")
        return Path(position.numpy(), velocity.numpy(), errors.numpy())

    def exact(self, count: int) -> np.ndarray:
        """Return positions of the exact path [m], (steps + 1, 3), steps a multiple of count: by the best method of fourth order here."""
        count *= FINER
        while count < FINEST:
            count *= 2
        return self.path("rk4" if self.tracer else "abm_pece_4", count).position

    def theory(self, solver: str) -> int:
        """Return the order that theory gives a solver here."""
        method = self.methods[solver]
        return method.damped_order if self.damped else method.order


def study(scene: Scene, system: str | None = None, solvers: Sequence[str] | None = None, first: int = 50, rungs: int = 8) -> Study:
    """Measure solvers (default: all of the system's form) at duration/first and at halves of it, `rungs` steps in all.

    Raises SceneError if the scene does not suit, ValueError for an unknown solver.
    """
    experiment = Experiment(scene, system)
    counts = [first << rung for rung in range(rungs)]
    strangers = set(solvers or ()) - set(experiment.methods)
    if strangers:
        raise ValueError(f"{sorted(strangers)[0]} is no solver of this system, whose are {', '.join(experiment.methods)}")
    exact = experiment.exact(counts[-1])
    if not np.isfinite(exact).all():
        place = f"systems.{experiment.system}.emitters.0.shape.center"
        words = f"the path from here leaves the finite world (start elsewhere: --set {place}=[…])"
        raise SceneError([Problem(words, path=place)])
    chosen = [solver for solver in experiment.methods if solvers is None or solver in solvers]
    methods = tuple(measured(experiment, solver, counts, exact) for solver in chosen)
    steps = tuple(experiment.duration / count for count in counts)
    form = "first-order" if experiment.tracer else "second-order"
    return Study(experiment.system, form, experiment.duration, steps, methods)


def convergence_order(scene: Scene, system: str | None = None, solver: str | None = None) -> float | None:
    """Return the order that a system's own solver shows, or another one; None where rounding or instability hides it."""
    name = system if system is not None else suitable_system(scene)
    return study(scene, name, [solver or scene.systems[name].method]).methods[0].order


def measured(experiment: Experiment, solver: str, counts: Sequence[int], exact: np.ndarray) -> MethodErrors:
    """Measure one solver."""
    errors, errors32 = ([distance(experiment.path(solver, n, bits).position, exact) for n in counts] for bits in (64, 32))
    floor = len(exact) * 0.5 * np.finfo(float).eps * np.abs(exact).max()  # all roundings of the exact path one way
    order = fitted_order([experiment.duration / count for count in counts], errors, floor)
    return MethodErrors(solver, experiment.theory(solver), order, tuple(errors), tuple(errors32))


def distance(position: np.ndarray, exact: np.ndarray) -> float:
    """Return the largest distance of a path from the exact one [m], inf if it is not finite."""
    with np.errstate(over="ignore", invalid="ignore"):
        far = np.linalg.norm(position - exact[:: (len(exact) - 1) // (len(position) - 1)], axis=1).max()
    return float(far) if np.isfinite(far) else math.inf


def fitted_order(steps: Sequence[float], errors: Sequence[float], floor: float) -> float | None:
    """Return the slope of log error over log step through the smallest steps whose errors are finite and above the floor."""
    good = [(h, e) for h, e in zip(steps, errors, strict=True) if floor < e < math.inf][-FITTED:]
    if len(good) < 2:
        return None
    h, e = np.log(np.array(good)).T
    return float(np.polyfit(h, e, 1)[0])


def suitable_system(scene: Scene) -> str:
    """Return the first system that suits. Raises SceneError if none does, with what stands in the way of the first."""
    if not scene.systems:
        raise SceneError([Problem("convergence is measured on a system of particles, and the scene has none", path="systems")])
    return next((name for name in scene.systems if not unsuitable(scene, name)), next(iter(scene.systems)))


def unsuitable(scene: Scene, name: str) -> list[Problem]:
    """Return what stands in the way of measuring a system: what has no float64, or no smooth path."""
    if name not in scene.systems:
        return [Problem(f"there is no system {name}; there are {', '.join(scene.systems)}", path="systems")]
    spec, found, place = scene.systems[name], [], f"systems.{name}"
    if spec.motion == "ballistic":
        found.append(Problem("motion: ballistic is in closed form and has no steps", path=f"{place}.motion"))
    elif not spec.emitters or spec.emitters[0].on or spec.emitters[0].shape.type not in SHAPES:
        words = f"its first emitter says where the particle starts: a shape of {', '.join(SHAPES)}, and not on events"
        found.append(Problem(words, path=f"{place}.emitters"))
    if scene.time.duration <= 0.0:
        found.append(Problem("a path needs a duration above 0 s", path="time.duration"))
    if scene.colliders and spec.feels.colliders not in (False, ()):
        found.append(Problem("convergence is measured without colliders (add feels: {colliders: false})", path="colliders"))
    if spec.coupling is not None:
        for k, flow in enumerate(scene.flow):
            if not felt(flow, k, spec.feels.flow):
                continue
            if flow.type not in FLOWS:
                found.append(Problem(f"convergence is measured in float64, which has flow {', '.join(FLOWS)} only", path=f"flow.{k}"))
            elif any(getattr(flow, "travel", ())):
                found.append(Problem("convergence is measured without flow that travels", path=f"flow.{k}.travel"))
        if scene.obstacles:
            found.append(Problem("convergence is measured without obstacles", path="obstacles"))
    if spec.coupling != "tracer":
        for k, force in enumerate(scene.forces):
            if felt(force, k, spec.feels.forces) and force.type != "attractor":
                found.append(Problem("convergence is measured with attractors only", path=f"forces.{k}"))
    return found


def felt(entry, place: int, chosen) -> bool:
    """Return whether a system feels an entry of the scene: all, none, or by name or place."""
    return chosen if isinstance(chosen, bool) else place in chosen or entry.name in chosen


def setting(scene: Scene, spec) -> Setting:
    """Make the device's setting: where the particle starts, and all that it feels."""
    emitter, table, result = spec.emitters[0], SignalTable(), Setting()
    result.x = wp.vec3d(*emitter.shape.center)
    result.inverse_mass = 1.0 / emitter.mass.mean
    result.begin = emitter.burst[0].at if emitter.burst else emitter.start or 0.0
    if spec.coupling != "tracer":
        if emitter.velocity is not None:
            direction = np.array(emitter.velocity.direction)
            result.v = wp.vec3d(*(emitter.velocity.speed.mean / np.linalg.norm(direction) * direction))
        stokes = 6.0 * math.pi * emitter.radius.mean * getattr(spec.coupling, "viscosity", 0.0)
        result.k = (getattr(spec.coupling, "alpha", 0.0) + stokes) * result.inverse_mass
        result.gravity = wp.vec3d(*scene.gravity) if spec.feels.gravity else wp.vec3d()
        result.pulls = wp.array([pull(force, table) for force in chosen(scene.forces, spec.feels.forces)], dtype=Pull, device="cpu")
    flows = chosen(scene.flow, spec.feels.flow) if spec.coupling is not None else []
    winds = [[table.add(component) for component in flow.velocity] for flow in flows if flow.type == "uniform"]
    formulas = [flow for flow in flows if flow.type != "uniform"]
    programs = [[table.add_program(program) for program in programs_of(flow)] for flow in formulas]
    spans = [[*(begin for begin, _ in program), program[-1][1]] for program in programs]
    gains = [table.add(getattr(flow, flow.strength_field)) if flow.strength_field else -1 for flow in formulas]
    result.winds = wp.array(np.array(winds, dtype=np.int32).reshape(-1, 3), dtype=int, device="cpu")
    result.spans = wp.array(np.array(spans, dtype=np.int32).reshape(-1, 4), dtype=int, device="cpu")
    result.gains = wp.array(np.array(gains, dtype=np.int32), dtype=int, device="cpu")
    result.signals = table.tables("cpu")
    return result


def programs_of(flow) -> list:
    """Return the three components of a flow as programs in x, y, z and t."""
    if flow.type == "expression":
        return list(flow.programs)
    return [compile_expression(text, PLACE) for text in FORMULAS[flow.type](flow)]


def chosen(specs: Sequence, selection) -> list:
    """Return the entries that a system feels."""
    return pick(specs, list(specs), selection)


def pull(spec, table: SignalTable) -> Pull:
    """Make an attractor's row."""
    row = Pull()
    row.law, row.center, row.softening = ATTRACTOR_LAWS[spec.law], wp.vec3d(*spec.center), spec.softening
    row.signal = strength_signals(spec.strength, table)[0]
    return row
