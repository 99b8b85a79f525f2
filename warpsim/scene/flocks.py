"""Flocks: boids that see their neighbors and steer by them."""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from warpsim.scene.assets import asset_path
from warpsim.scene.base import Mistake, Name, Number, ShortSpec, Spec, Truth, Vec3, WholeNumber, form_by_key, mistakes, one_of_forms
from warpsim.scene.look import ColorBy, ColorRamp, Look, Ramp, color_form
from warpsim.scene.nearest import listed, nearest
from warpsim.scene.particles import Drag, Feels, StokesDrag, System, repeated_names
from warpsim.scene.steering import BehaviorUnion

Distance = Annotated[Number, Field(ge=1e-6, le=1e9)]  # the least: float32 holds the squares of a thousandth of it
Nearest = Annotated[WholeNumber, Field(ge=1, le=64)]
Speed = Annotated[Number, Field(ge=0.0, le=1e9)]
FlockCoupling = one_of_forms({"alpha": Drag, "viscosity": StokesDrag}, lambda value: form_by_key(value, ("alpha", "viscosity")))


class Domain(Spec):
    """A box that a flock starts in. An axis of no extent does not exist: the flock is two-dimensional, or one."""

    min: Vec3 = Field(description="Corner with the least coordinates [m].")
    max: Vec3 = Field(description="Corner with the greatest [m].")
    boundary: Literal["none", "contain", "periodic"] = Field(
        "none", description="What its borders do: nothing, throw boids back, or let them come in on the other side."
    )

    @property
    def size(self) -> tuple[float, float, float]:
        """Its edges [m]."""
        return tuple(high - low for low, high in zip(self.min, self.max, strict=True))

    @model_validator(mode="after")
    def _corners_in_order(self):
        found = [
            Mistake(("max", axis), f"must not be below min, {self.max[axis]:g} < {self.min[axis]:g}", ("min", "max"))
            for axis in range(3)
            if self.max[axis] < self.min[axis]
        ]
        if found:
            raise mistakes(found)
        return self


class Perception(Spec):
    """Whom a boid sees."""

    radius: Distance = Field(description="How far [m].")
    field_of_view: Annotated[Number, Field(ge=0.0, le=360.0)] = Field(360.0, description="The full angle round its heading [degrees].")
    nearest: Nearest | None = Field(None, description="How many of those count, the nearest; absent: all [1].")


class Rule(ShortSpec):
    """A rule of the flock. A bare number is its weight."""

    shorthand: ClassVar[str] = "weight"
    weight: Annotated[Number, Field(ge=-1e9, le=1e9)] = Field(description="Factor of the rule's force; negative: the other way round [1].")
    radius: Distance | None = Field(None, description="Within which neighbors count; absent: all that it sees [m].")


class Attends(Spec):
    """What the boids of a flock do because of those of another, which they see where it was when the frame began."""

    separation: Rule = Field(Rule(weight=0.0), description="Away from them, the more the nearer: a weight, or {weight, radius}.")
    cohesion: Rule = Field(Rule(weight=0.0), description="Toward the centroid of those seen: a weight, or {weight, radius}.")
    alignment: Rule = Field(Rule(weight=0.0), description="Toward their mean velocity: a weight, or {weight, radius}.")
    radius: Distance | None = Field(None, description="How far they are seen; absent: as far as the flock sees its own [m].")
    field_of_view: Annotated[Number, Field(ge=0.0, le=360.0)] | None = Field(
        None, description="The full angle round the heading; absent: as for its own [degrees]."
    )
    nearest: Nearest | None = Field(None, description="How many of those seen count, the nearest; absent: all [1].")

    @property
    def rules(self) -> dict[str, Rule]:
        """The three rules by name."""
        return {key: getattr(self, key) for key in ("separation", "cohesion", "alignment")}


class Start(Spec):
    """Where boids are at the beginning, and how fast."""

    file: asset_path(".npz") | None = Field(None, description="A file with position and velocity, (count, 3) each; absent: at random.")
    speed: Speed | None = Field(None, description="At random headings; absent: the middle of the band of speeds, else 1 [m/s].")
    seed: Annotated[WholeNumber, Field(ge=0, le=2**32 - 1)] = Field(0, description="Another one gives other places and headings [1].")

    @model_validator(mode="after")
    def _one_way(self):
        if self.file is not None and self.speed is not None:
            raise mistakes([Mistake(("speed",), "the file gives velocities: leave speed out", ("file", "speed"))])
        return self


class Vicsek(Spec):
    """Vicsek's flock: one speed, and each takes the mean heading of its neighborhood, itself included, turned at random."""

    speed: Annotated[Number, Field(gt=0.0, le=1e9)] = Field(description="The speed of all [m/s].")
    noise: Annotated[Number, Field(ge=0.0, le=6.283185307179587)] = Field(
        description="Turns are uniform on ± half of it; in space about any axis across the heading [rad]."
    )


class FlockColor(ColorBy):
    """A color that shows a quantity of the boids through a color map."""

    by: Literal["speed", "height", "heading", "neighbors"] = Field(
        description="The quantity: speed (m/s), height y (m), heading about the vertical, -180 to 180 from +x toward +z (degrees), or "
        "neighbors seen."
    )


class FlockLook(Look):
    """How a flock is drawn."""

    as_: Literal["arrows", "birds", "fish", "points", "sprites"] = Field(
        "arrows",
        alias="as",
        description="Bodies that point where they go (arrows, birds, fish), spheres (points), or soft and round (sprites).",
    )
    size: Ramp = Field(Ramp(over_life=((0.0, 0.3),)), description="Length of a body, diameter of a point [m].")
    color: one_of_forms({"over_life": ColorRamp, "by": FlockColor}, color_form) = Field(
        ColorRamp(over_life=((0.0, "#ffffff"),)), description="One color, or {by: quantity, range, map}."
    )


class FlockFeels(Feels):
    """Which parts of the environment act on a flock: all but gravity, which its wings or fins hold up."""

    gravity: Truth = Field(False, description="Whether gravity acts.")


class Flock(System):
    """Boids: F = separation sum (Pi - Pj)/|Pi - Pj|^2 + cohesion (centroid - Pi) + alignment (mean v - vi) over the neighbors seen."""

    type: Literal["flock"] = Field("flock", description="Kind of system.")
    count: Annotated[WholeNumber, Field(ge=0, le=2**24)] = Field(description="Number of boids [1].")
    domain: Domain | None = Field(None, description="The box they start in, and what its borders do; absent: start needs a file.")
    perception: Perception = Field(description="Whom a boid sees.")
    separation: Rule = Field(Rule(weight=1.0), description="Away from neighbors, the more the nearer: a weight, or {weight, radius}.")
    cohesion: Rule = Field(Rule(weight=1.0), description="Toward the centroid of the neighbors: a weight, or {weight, radius}.")
    alignment: Rule = Field(Rule(weight=1.0), description="Toward the neighbors' mean velocity: a weight, or {weight, radius}.")
    speed: tuple[Speed, Speed] | None = Field(None, description="Least and greatest speed; absent: any [m/s].")
    max_force: Annotated[Number, Field(gt=0.0, le=1e12)] | None = Field(None, description="Most steering force; absent: any [N].")
    turn_rate: Annotated[Number, Field(gt=0.0, le=1e9)] | None = Field(
        None, description="Fastest turn of the heading; absent: any [deg/s]."
    )
    attends: dict[Name, Attends] = Field({}, description="Other flocks by name, and what the boids do because of them.")
    steering: tuple[BehaviorUnion, ...] = Field((), max_length=64, description="What boids do besides; their forces add up.")
    vicsek: Vicsek | None = Field(None, description="Instead of the three rules: Vicsek's model, one turn per substep.")
    mass: Annotated[Number, Field(ge=1e-12, le=1e12)] = Field(1.0, description="Of a boid [kg].")
    radius: Annotated[Number, Field(gt=0.0, le=1e6)] = Field(0.05, description="Of a boid, for drag by viscosity [m].")
    thickness: Annotated[Number, Field(ge=0.0, le=1e6)] = Field(0.0, description="How far boids are kept from colliders [m].")
    coupling: FlockCoupling | None = Field(None, description="Drag of the flow: {alpha: kg/s} or {viscosity: Pa s}; absent: no effect.")
    start: Start = Field(Start(), description="Where boids are at the beginning.")
    feels: FlockFeels = Field(FlockFeels(), description="What acts on the flock.")
    look: FlockLook = Field(FlockLook(), description="How it is drawn.")

    @property
    def method(self) -> str:
        """The solver in effect."""
        return "semi_implicit_euler"

    @property
    def pace(self) -> float:
        """How fast boids want to be that steer: the greatest speed of the band, else that at which they start [m/s]."""
        return self.speed[1] if self.speed else self.starting_speed

    @property
    def starting_speed(self) -> float:
        """How fast boids start that get their headings at random [m/s]."""
        if self.vicsek is not None:
            return self.vicsek.speed
        if self.start.speed is not None:
            return self.start.speed
        return 0.5 * sum(self.speed) if self.speed else 1.0

    @property
    def point_count(self) -> int:
        """How many boids there are."""
        return self.count

    @property
    def rules(self) -> dict[str, Rule]:
        """The three rules by name; Vicsek's flock knows alignment alone."""
        if self.vicsek is not None:
            return {"separation": Rule(weight=0.0), "cohesion": Rule(weight=0.0), "alignment": Rule(weight=1.0)}
        return {key: getattr(self, key) for key in ("separation", "cohesion", "alignment")}

    @model_validator(mode="after")
    def _parts_fit(self):
        found = []
        if self.domain is None and self.start.file is None:
            found.append(Mistake((), "a flock needs a domain to start in, or start: {file: …}", ("domain", "start")))
        if self.speed is not None and self.speed[1] < self.speed[0]:
            found.append(Mistake(("speed", 1), f"the greatest speed is below the least, {self.speed[1]:g} < {self.speed[0]:g}", ("speed",)))
        found += _blind_mistakes((), self, self.perception.radius)
        for name, one in self.attends.items():
            found += _blind_mistakes(("attends", name), one, one.radius or self.perception.radius)
        found += _fold_mistakes(self) + _vicsek_mistakes(self) + _steering_mistakes(self)
        if found:
            raise mistakes(found)
        return self


def _blind_mistakes(path: tuple, rules: Any, radius: float) -> list[Mistake]:
    """Return a mistake for each rule that counts neighbors farther away than is seen."""
    words = f"nobody farther than the perception's radius, {radius:g} m, is seen"
    beyond = [key for key, rule in rules.rules.items() if rule.radius is not None and rule.radius > radius]
    return [Mistake((*path, key, "radius"), words, ("perception", key, *path[:1])) for key in beyond]


def attention_mistakes(scene: Any) -> list[Mistake]:
    """Return a mistake for each flock that attends to none, to itself, or to one in another periodic domain."""
    found = []
    flocks = {name: spec for name, spec in scene.systems.items() if isinstance(spec, Flock)}
    for name, spec in flocks.items():
        for other, one in spec.attends.items():
            path, depends = ("systems", name, "attends", other), ("systems",)
            others = [known for known in flocks if known != name]
            if other == name:
                words = "a flock attends to itself by its own separation, cohesion and alignment"
                found.append(Mistake(path, words, depends))
            elif other not in flocks:
                words = f'there is no other flock "{other}" (flocks: {listed(others) or "none"})'
                found.append(Mistake(path, words, depends, nearest(other, others)))
            elif "periodic" in (_boundary(spec), _boundary(flocks[other])):
                if spec.domain != flocks[other].domain:
                    found.append(Mistake(path, f"{name} and {other} must share one periodic domain to see each other across it", depends))
                elif one.radius and one.radius > 0.5 * min(edge for edge in spec.domain.size if edge > 0.0):
                    found.append(Mistake((*path, "radius"), "sees round the periodic domain: at most half of its shortest edge", depends))
    return found


def outlying_mistakes(scene: Any) -> list[Mistake]:
    """Return a mistake for each corner of a flock's domain that lies beyond the scene's extent: boids there count as lost."""
    return [
        Mistake(("systems", name, "domain", end, axis), f"lies beyond limits.extent, {scene.limits.extent:g} m", ("limits",))
        for name, spec in scene.systems.items()
        if isinstance(spec, Flock) and spec.domain
        for end in ("min", "max")
        for axis in range(3)
        if abs(getattr(spec.domain, end)[axis]) > scene.limits.extent
    ]


def _boundary(flock: Flock) -> str:
    return flock.domain.boundary if flock.domain else "none"


def _fold_mistakes(flock: Flock) -> list[Mistake]:
    """Return a mistake for each axis of a periodic domain that a boid could look round: it would see the same neighbor twice."""
    if flock.domain is None or flock.domain.boundary != "periodic":
        return []
    shortest = min((edge for edge in flock.domain.size if edge > 0.0), default=0.0)
    if shortest == 0.0:
        return [Mistake(("domain", "max"), "a periodic domain has an extent along one axis at least", ("domain",))]
    if flock.perception.radius > 0.5 * shortest:
        words = f"sees round a periodic domain of {shortest:g} m: at most half of it, {0.5 * shortest:g}"
        return [Mistake(("perception", "radius"), words, ("domain", "perception"))]
    return []


def _vicsek_mistakes(flock: Flock) -> list[Mistake]:
    """Return a mistake for each key that Vicsek's model has no use for, and for a space in which there is nothing to turn to."""
    if flock.vicsek is None:
        return []
    idle = ("separation", "cohesion", "alignment", "speed", "max_force", "turn_rate", "coupling", "steering", "attends")
    found = [
        Mistake((key,), f"vicsek knows one speed and its neighbors' headings only: leave {key} out", ("vicsek", key))
        for key in idle
        if getattr(flock, key) != Flock.model_fields[key].default
    ]
    if flock.start.speed is not None:
        found.append(Mistake(("start", "speed"), "vicsek.speed is the speed of all: leave this one out", ("vicsek", "start")))
    if flock.domain is None or sum(edge > 0.0 for edge in flock.domain.size) < 2:
        found.append(Mistake(("vicsek",), "needs a domain with an extent along two axes at least, to turn in", ("domain", "vicsek")))
    return found


def _steering_mistakes(flock: Flock) -> list[Mistake]:
    """Return a mistake for each behavior that lacks its goal, its leader or its walls."""
    found = repeated_names("steering", flock.steering)
    for k, one in enumerate(flock.steering):
        if one.type == "leader" and (one.boid is None) == (one.target is None):
            found.append(
                Mistake(("steering", k), "give either the number of a boid that leads, or a target", ("steering", ("steering", k)))
            )
        elif one.type == "leader" and one.boid is not None and one.boid >= flock.count:
            message = f"there is no boid {one.boid}: there are {flock.count}, counted from 0"
            found.append(Mistake(("steering", k, "boid"), message, ("steering", "count")))
        elif one.type == "contain" and (flock.domain is None or flock.domain.boundary == "periodic"):
            words = "there are no walls to keep away from: the domain has none, or is periodic"
            found.append(Mistake(("steering", k, "type"), words, ("steering", "domain")))
        elif one.type == "path" and all(a == b for a, b in zip(one.points, one.points[1:], strict=False)):
            found.append(Mistake(("steering", k, "points"), "all points of the path are one", ("steering",)))
    return found
