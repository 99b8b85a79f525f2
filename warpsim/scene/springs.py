"""Springs: networks of points joined by damped springs, with pins that hold or move some of them."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from warpsim.scene.base import Mistake, Name, Number, Spec, Vec3, WholeNumber, form_by_key, is_number, mistakes, one_of_forms
from warpsim.scene.generators import GeneratorUnion
from warpsim.scene.look import Look
from warpsim.scene.muscles import Grip, Line, Muscle, body_mistakes, triangle_mistakes
from warpsim.scene.nearest import listed, nearest
from warpsim.scene.particles import Drag, Solver, StokesDrag, System
from warpsim.scene.strengths import Moment, Strength

CoupledSolver = Literal[Solver, "implicit_euler", "xpbd"]
SOLVERS_WITH = {"iterations": ("implicit_euler", "xpbd"), "tolerance": ("implicit_euler",)}  # keys that not every solver knows
MOST_PASSES = 100  # of xpbd, each of them launches of its own
Index = Annotated[WholeNumber, Field(ge=0)]
_MOST_TOLD = 50


def _each_form(value: Any) -> str | None:
    return "one" if is_number(value) else "each" if isinstance(value, (list, tuple)) else None


def one_or_each(kind: Any) -> Any:
    """Return the type of a value that is the same for all, or a list with one for each."""
    return one_of_forms({"one": kind, "each": tuple[kind, ...]}, _each_form)


Mass = one_or_each(Annotated[Number, Field(ge=1e-12, le=1e12)])
Coefficient = one_or_each(Annotated[Number, Field(ge=0.0, le=1e12)])
RestLength = one_or_each(Annotated[Number, Field(ge=0.0, le=1e9)])
NetworkCoupling = one_of_forms({"alpha": Drag, "viscosity": StokesDrag}, lambda value: form_by_key(value, ("alpha", "viscosity")))


def _pin_form(value: Any) -> str | None:
    return "group" if isinstance(value, str) else "point" if is_number(value) else "cell" if isinstance(value, (list, tuple)) else None


Pin = one_of_forms({"group": Name, "point": Index, "cell": tuple[Index, Index]}, _pin_form)
Displacement = tuple[Strength, Strength, Strength]


class PinMotion(Spec):
    """How pinned points move: their displacement from where they start, by keyframes or as three strengths."""

    pins: tuple[Pin, ...] = Field((), description="Which of the pins; absent: all of them.")
    keyframes: tuple[tuple[Moment, Vec3], ...] = Field(
        (), max_length=4096, description="Pairs of time in seconds and displacement [dx, dy, dz], linear between, constant outside [m]."
    )
    displacement: Displacement | None = Field(None, description="Instead of keyframes: three strengths, numbers that may vary in time [m].")

    @model_validator(mode="after")
    def _one_form(self):
        found = []
        if bool(self.keyframes) == (self.displacement is not None):
            message = "give either keyframes or displacement" + (", not both" if self.keyframes else "")
            found.append(Mistake(("keyframes" if self.keyframes else "displacement",), message, ("keyframes", "displacement")))
        for k in range(1, len(self.keyframes)):
            if self.keyframes[k][0] <= self.keyframes[k - 1][0]:
                message = f"times must rise: {self.keyframes[k][0]:g} does not come after {self.keyframes[k - 1][0]:g}"
                found.append(Mistake(("keyframes", k, 0), message, ("keyframes",)))
        if found:
            raise mistakes(found)
        return self


class NetworkLook(Look):
    """How a network is drawn: its points as particles are, its springs, its surface."""

    as_: Literal["points", "sprites"] = Field("points", alias="as", description="Points as spheres (points) or soft and round (sprites).")
    show: tuple[Literal["points", "springs", "surface"], ...] = Field(
        (), max_length=3, description="What of it is drawn; absent: its surface if it has one, else points and springs."
    )
    width: Annotated[Number, Field(ge=0.0, le=1e6)] | None = Field(None, description="Of a spring; absent: 0.4 of a point's size [m].")


class Network(System):
    """What networks of springs and cloth have in common: they neither lose nor gain points, and some may be pinned."""

    solver: CoupledSolver = Field("semi_implicit_euler", description="Method of integration.")
    iterations: Annotated[WholeNumber, Field(ge=1, le=10_000)] | None = Field(
        None,
        description="Of implicit_euler: the most iterations of conjugate gradients per substep, absent: 100. Of xpbd: passes over the "
        "springs per substep, absent: 1 [1].",
    )
    tolerance: Annotated[Number, Field(ge=1e-6, le=0.5)] | None = Field(
        None, description="Of implicit_euler: what is left, of what there was to solve, when the iterations end; absent: 1e-4 [1]."
    )
    coupling: NetworkCoupling | None = Field(
        None, description="Drag of the flow on every point: {alpha: kg/s} or {viscosity: Pa s}; absent: no effect."
    )
    radius: Annotated[Number, Field(gt=0.0, le=1e6)] = Field(1e-3, description="Radius of a point, for drag by viscosity [m].")
    look: NetworkLook = Field(NetworkLook(), description="How it is drawn.")
    thickness: Annotated[Number, Field(ge=0.0, le=1e6)] = Field(0.0, description="How far its points are kept from colliders [m].")
    strain_limit: Annotated[Number, Field(ge=1e-3, le=1e3)] | None = Field(
        None, description="Strain, stretching over rest length, beyond which no spring goes: it is shortened instead; absent: no limit [1]."
    )
    tear: Annotated[Number, Field(gt=0.0, le=1e6)] | None = Field(
        None, description="Strain, stretching over rest length, above which a spring breaks for good; absent: none does [1]."
    )
    pin_motion: tuple[PinMotion, ...] = Field((), max_length=1024, description="How pinned points move; absent: they stay.")

    @property
    def method(self) -> str:
        """The solver in effect."""
        return self.solver

    def acts(self, key: str) -> bool:
        """Return whether a number of it is not zero, or a list not empty; a network without the key has none."""
        value = getattr(self, key, None)
        return any(value) if isinstance(value, tuple) and key == "damping" else bool(value)

    def pinned(self, pins: Sequence[str | int | tuple[int, int]]) -> list[int]:
        """Return the points that pins of this network name, each once, in their order."""
        return list(dict.fromkeys(i for pin in pins for i in self._points_of(pin)))

    def _points_of(self, pin: str | int | tuple[int, int]) -> Sequence[int]:
        if isinstance(pin, tuple):
            return (pin[1] * self.generator.resolution[0] + pin[0],)
        return self.generator.group(pin) if isinstance(pin, str) else (pin,)


class Springs(Network):
    """Points joined by springs: F = (k (d - rest length) + damping (rate of stretching)) along the spring."""

    type: Literal["springs"] = Field("springs", description="Kind of system.")
    points: tuple[Vec3, ...] = Field((), max_length=200_000, description="Where the points start [m].")
    springs: tuple[tuple[Index, Index], ...] = Field(
        (), max_length=200_000, description="Pairs of points that a spring joins, numbered from 0 [1]."
    )
    generator: GeneratorUnion | None = Field(None, description="Points and springs by rule, instead of lists.")
    mass: Mass = Field(1.0, description="Of a point: one number, or a list with one for each [kg].")
    stiffness: Coefficient = Field(description="Force per length of stretching: one number, or a list with one for each spring [N/m].")
    damping: Coefficient = Field(
        0.0, description="Force per speed of stretching, along the spring only: one number, or a list with one for each [N s/m]."
    )
    rest_length: RestLength | None = Field(
        None, description="Length at which a spring does not pull: one number, or a list with one for each; absent: as it starts [m]."
    )
    pins: tuple[Pin, ...] = Field(
        (), max_length=200_000, description="Points that are held: numbers, the generator's groups, or [i, j] of a grid."
    )
    triangles: tuple[tuple[Index, Index, Index], ...] = Field(
        (), max_length=200_000, description="Its surface: triples of points, counterclockwise from outside [1]."
    )
    water: Annotated[Number, Field(ge=0.0, le=1e12)] | None = Field(
        None,
        description="Resistance of the flow to what of the surface moves into it, F = -water A ((v - u) n) n; absent: none [kg/(m^2 s)].",
    )
    chains: dict[Name, Line] = Field(
        {}, description="Points in a row, by name, each joined to the next by a spring: for muscles and grip [1]."
    )
    muscles: tuple[Muscle, ...] = Field((), max_length=1024, description="Springs whose rest lengths vary in time.")
    grip: Grip | None = Field(
        None, description="Friction that depends on where along the body a point slides; absent: the same everywhere."
    )

    @property
    def has_surface(self) -> bool:
        """Whether there are triangles."""
        return bool(self.generator.has_surface if self.generator else self.triangles)

    def chain_points(self, name: str) -> Sequence[int]:
        """Return the points of a chain, of its own or the generator's."""
        return self.chains[name] if name in self.chains else self.generator.chain(name)

    @property
    def point_count(self) -> int | None:
        """How many points there are; None where a file says so."""
        return self.generator.point_count if self.generator else len(self.points)

    @property
    def spring_count(self) -> int | None:
        """How many springs there are; None where a file says so."""
        return self.generator.spring_count if self.generator else len(self.springs)

    @model_validator(mode="after")
    def _parts_fit(self):
        found = solver_mistakes(self) + (_source_mistakes(self) or _spring_mistakes(self))
        found += _length_mistakes(self)
        where = [(("pins",), self.pins)] + [(("pin_motion", k, "pins"), motion.pins) for k, motion in enumerate(self.pin_motion)]
        strange = [mistake for path, pins in where for mistake in pin_mistakes(path, pins, self.generator, self.point_count)]
        found += strange or motion_mistakes(self)
        found += body_mistakes(self) + strain_mistakes(self)
        if self.water is not None and not self.has_surface:
            message = "the flow resists triangles, and there are none: triangles names them, or a generator with a surface makes them"
            found.append(Mistake(("water",), message, ("water", "triangles", "generator")))
        if found:
            raise mistakes(found[:_MOST_TOLD])
        return self


def _source_mistakes(net: Springs) -> list[Mistake]:
    if net.generator:
        keys = [key for key in ("points", "springs", "triangles") if getattr(net, key)]
        return [Mistake((key,), f"the generator makes the {key}: leave one of them out", (key, "generator")) for key in keys]
    if not net.points:
        return [Mistake((), "a network needs points and springs, or a generator that makes them", ("points", "generator"))]
    return triangle_mistakes(net.triangles, len(net.points))


def _spring_mistakes(net: Springs) -> list[Mistake]:
    first: dict[tuple[int, int], int] = {}
    found = []
    for k, (i, j) in enumerate(net.springs):
        beyond = max(i, j)
        if beyond >= len(net.points):
            message = f"there is no point {beyond}: there are {len(net.points)}, counted from 0"
            found.append(Mistake(("springs", k, int(j == beyond)), message, ("springs", "points")))
        elif i == j:
            found.append(Mistake(("springs", k), f"a spring joins two points, not point {i} with itself", ("springs",)))
        elif first.setdefault((min(i, j), max(i, j)), k) != k:
            message = f"points {i} and {j} are joined by springs.{first[min(i, j), max(i, j)]} already: add its stiffness to that one"
            found.append(Mistake(("springs", k), message, ("springs",)))
        elif net.points[i] == net.points[j] and (rest := _rest_of(net, k)):
            message = f"points {i} and {j} start at the same place: a spring of {rest:g} m has no direction to push in; move one of them"
            found.append(Mistake(("springs", k), message, ("springs", "points", "rest_length")))
    return found


def _rest_of(net: Springs, k: int) -> float | None:
    """Return the rest length that is given to spring k; None where it is as it starts, or the list is too short."""
    rest = net.rest_length
    return rest if not isinstance(rest, tuple) else rest[k] if k < len(rest) else None


def _length_mistakes(net: Springs) -> list[Mistake]:
    """Return a mistake for each list that does not have one value for each."""
    counts = {"mass": ("point", net.point_count)} | {key: ("spring", net.spring_count) for key in ("stiffness", "damping", "rest_length")}
    found = []
    for key, (thing, count) in counts.items():
        value = getattr(net, key)
        if isinstance(value, tuple) and count is not None and len(value) != count:
            message = f"has {len(value)} values for {count} {thing}s: give one number for all, or one for each"
            found.append(Mistake((key,), message, (key, "points", "springs", "generator")))
    return found


def pin_mistakes(path: tuple, pins: Sequence[str | int | tuple[int, int]], generator: Any, count: int | None = None) -> list[Mistake]:
    """Return a mistake for each pin that is no point and no group of the network; `count` are its points, where they are known."""
    found = []
    groups = generator.groups if generator else ()
    grid = generator.resolution if getattr(generator, "type", None) == "grid" else None
    count = generator.point_count if generator else count
    depends = (path[0], "points", "generator", "resolution")
    for k, pin in enumerate(pins):
        if isinstance(pin, str) and pin not in groups:
            known = f"groups: {listed(groups)}; or numbers of points" if groups else "its points have numbers only"
            found.append(Mistake((*path, k), f'there is no group "{pin}" ({known})', depends, nearest(pin, groups)))
        elif isinstance(pin, tuple) and grid is None:
            found.append(Mistake((*path, k), "[i, j] names a point of a grid: here a point is one number", depends))
        elif isinstance(pin, tuple) and (pin[0] >= grid[0] or pin[1] >= grid[1]):
            message = f"there is no point [{pin[0]}, {pin[1]}]: i goes to {grid[0] - 1} and j to {grid[1] - 1}"
            found.append(Mistake((*path, k), message, depends))
        elif isinstance(pin, int) and count is not None and pin >= count:
            found.append(Mistake((*path, k), f"there is no point {pin}: there are {count}, counted from 0", depends))
    return found


def solver_mistakes(net: Any) -> list[Mistake]:
    """Return a mistake for each number that the network's solver does not know."""
    keys = [key for key in ("iterations", "tolerance") if getattr(net, key) is not None and net.solver not in SOLVERS_WITH[key]]
    found = [Mistake((key,), f"{key} is for {' and '.join(SOLVERS_WITH[key])}, not {net.solver}", (key, "solver")) for key in keys]
    if net.solver == "xpbd" and (net.iterations or 1) > MOST_PASSES:
        message = f"xpbd makes at most {MOST_PASSES} passes per substep: more substeps do more than more passes"
        found.append(Mistake(("iterations",), message, ("iterations", "solver", "substeps")))
    return found


def strain_mistakes(net: Network) -> list[Mistake]:
    """Return a mistake where springs should both break and be kept from it."""
    if net.tear is None or net.strain_limit is None:
        return []
    message = "with a strain_limit no spring is ever strained enough to tear, or each tears before it is limited: give either"
    return [Mistake(("strain_limit",), message, ("strain_limit", "tear"))]


def motion_mistakes(net: Any) -> list[Mistake]:
    """Return a mistake for each motion of points that are not pinned, or that another motion moves already."""
    held = set(net.pinned(net.pins))
    moved: dict[int, int] = {}
    found = []
    for k, motion in enumerate(net.pin_motion):
        points = net.pinned(motion.pins or net.pins)
        loose = [i for i in points if i not in held]
        taken = [i for i in points if moved.setdefault(i, k) != k]
        if loose or not points:
            what = f"point {loose[0]} is not pinned" if loose else "there are no pins to move"
            found.append(Mistake(("pin_motion", k, "pins"), f"{what}: pins names what is held", ("pins", "pin_motion")))
        elif taken:
            message = f"point {taken[0]} is moved by pin_motion.{moved[taken[0]]} already"
            found.append(Mistake(("pin_motion", k, "pins"), message, ("pins", "pin_motion")))
    return found
