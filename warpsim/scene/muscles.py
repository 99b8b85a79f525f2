"""Muscles: springs whose rest lengths follow the time; and what lets a body crawl, grip on the ground that depends on where it slides."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Any

from pydantic import Field, model_validator

from warpsim.scene.base import Direction, Mistake, Name, Number, Spec, WholeNumber, is_number, mistakes, one_of_forms
from warpsim.scene.nearest import listed, nearest
from warpsim.scene.strengths import PositiveStrength

Index = Annotated[WholeNumber, Field(ge=0)]
Line = Annotated[tuple[Index, ...], Field(min_length=2, max_length=200_000)]
_MOST_TOLD = 50


def _several_form(value: Any) -> str | None:
    return "one" if isinstance(value, str) else "several" if isinstance(value, (list, tuple)) else None


ChainNames = one_of_forms({"one": Name, "several": Annotated[tuple[Name, ...], Field(min_length=1, max_length=1024)]}, _several_form)
SomeSprings = one_of_forms({"one": Name, "several": Annotated[tuple[Index, ...], Field(min_length=1, max_length=200_000)]}, _several_form)
_Share = Annotated[Number, Field(ge=-1.0, le=1.0)]
Shares = one_of_forms(
    {"one": _Share, "ends": tuple[_Share, _Share]},
    lambda value: "one" if is_number(value) else "ends" if isinstance(value, (list, tuple)) else None,
)


class Wave(Spec):
    """Rest lengths swing by a factor 1 + amplitude * sin(2 pi (t/period - s/wavelength) + phase), s being the way along a chain."""

    amplitude: Shares = Field(
        description="Share of the rest length by which it swings: one number, or [at the beginning, at the end], linear between [1]."
    )
    period: Number = Field(gt=0.0, le=1e7, description="Time of one full swing [s].")
    wavelength: Annotated[Number, Field(gt=0.0, le=1e9)] | None = Field(
        None, description="From crest to crest; the crests run from the beginning of a chain to its end; absent: all swing at once [m]."
    )
    direction: Direction | None = Field(
        None, description="Where the crests run, of any length, instead of along a chain; needed where springs have numbers [1]."
    )
    phase: Number = Field(0.0, ge=-1e3, le=1e3, description="Angle of the wave at t = 0 and s = 0 [rad].")


class Muscle(Spec):
    """Springs whose rest lengths vary in time: those along chains, or of some numbers; all alike by `rest`, or by a wave."""

    chain: ChainNames | None = Field(None, description="Name of a chain of points, or a list of them: the springs along it.")
    part: tuple[Annotated[Number, Field(ge=0.0, le=1.0)], Annotated[Number, Field(ge=0.0, le=1.0)]] = Field(
        (0.0, 1.0), description="The part of each chain that counts, from its beginning 0 to its end 1, by the springs' middles [1]."
    )
    springs: SomeSprings | None = Field(None, description="Instead of a chain: numbers of springs, a group of the generator's, or all.")
    rest: PositiveStrength | None = Field(None, description="Factor of their rest lengths, a number that may vary in time [1].")
    wave: Wave | None = Field(None, description="Instead of rest: a wave that travels along them.")
    activation: PositiveStrength = Field(1.0, description="How much of it acts, a number that may vary in time: 0 none, 1 all of it [1].")

    @model_validator(mode="after")
    def _one_of_each(self):
        found = []
        for first, second in (("chain", "springs"), ("rest", "wave")):
            given = [key for key in (first, second) if getattr(self, key) is not None]
            if len(given) != 1:
                message = f"give either {first} or {second}" + (", not both" if given else "")
                found.append(Mistake((second,) if given else (), message, (first, second)))
        if self.part[0] >= self.part[1]:
            found.append(Mistake(("part", 1), f"the part must have a length: {self.part[1]:g} is not beyond {self.part[0]:g}", ("part",)))
        if self.springs is not None and self.part != (0.0, 1.0):
            found.append(Mistake(("part",), "springs with numbers have no parts: part is for chains", ("part", "springs")))
        if self.wave and self.springs is not None and self.wave.direction is None and self.wave.wavelength is not None:
            found.append(Mistake(("wave",), "a wave through springs with numbers needs a direction", ("wave", "springs")))
        if found:
            raise mistakes(found)
        return self

    @property
    def chains(self) -> tuple[str, ...]:
        """Names of its chains."""
        return (self.chain,) if isinstance(self.chain, str) else self.chain or ()


class Grip(Spec):
    """Friction on colliders that depends on where along the body a point slides, as by bristles: factors of the collider's friction."""

    chain: ChainNames = Field(description="Name of a chain of points from head to tail, or a list of them: whose points have bristles.")
    forward: Annotated[Number, Field(ge=0.0, le=1e6)] = Field(1.0, description="Factor where it slides toward the head [1].")
    backward: Annotated[Number, Field(ge=0.0, le=1e6)] = Field(1.0, description="Factor where it slides toward the tail [1].")
    sideways: Annotated[Number, Field(ge=0.0, le=1e6)] = Field(1.0, description="Factor where it slides across the body [1].")

    @property
    def chains(self) -> tuple[str, ...]:
        """Names of its chains."""
        return (self.chain,) if isinstance(self.chain, str) else self.chain


def body_mistakes(net: Any) -> list[Mistake]:
    """Return the mistakes in chains, muscles and grip of a network of springs."""
    found = _chain_mistakes(net)
    known = (*net.chains, *(net.generator.chains if net.generator else ()))
    named = [(("muscles", k, "chain"), muscle.chains) for k, muscle in enumerate(net.muscles)]
    for path, chains in [*named, (("grip", "chain"), net.grip.chains if net.grip else ())]:
        for name in [name for name in chains if name not in known]:
            words = f"chains: {listed(known)}" if known else "it has none: chains names some"
            found.append(Mistake(path, f'there is no chain "{name}" ({words})', ("chains", "generator"), nearest(name, known)))
    return found or _strange_springs(net)


def _chain_mistakes(net: Any) -> list[Mistake]:
    found = []
    joined = {frozenset(pair) for pair in net.springs} if net.generator is None else None
    for name, line in net.chains.items():
        beyond = [i for i in line if net.point_count is not None and i >= net.point_count]
        if name in (net.generator.chains if net.generator else ()):
            found.append(Mistake(("chains", name), f'the generator makes a chain "{name}": take another name', ("chains", "generator")))
        elif beyond:
            message = f"there is no point {beyond[0]}: there are {net.point_count}, counted from 0"
            found.append(Mistake(("chains", name), message, ("chains", "points", "generator")))
        elif joined is not None:
            loose = [pair for pair in pairwise(line) if frozenset(pair) not in joined]
            found += [Mistake(("chains", name), unjoined(*loose[0]), ("chains", "springs"))] if loose else []
    return found


def unjoined(i: int, j: int) -> str:
    """Say that a chain leads over two points that no spring joins."""
    return f"no spring joins points {i} and {j}: a chain leads from point to point along springs"


def _strange_springs(net: Any) -> list[Mistake]:
    """Return a mistake for each number of a muscle that is no spring."""
    found = []
    for k, muscle in enumerate(net.muscles):
        groups = ("all", *(net.generator.spring_groups if net.generator else ()))
        if isinstance(muscle.springs, str) and muscle.springs not in groups:
            message = f'there is no group of springs "{muscle.springs}" (groups: {listed(groups)}; or numbers of springs)'
            found.append(Mistake(("muscles", k, "springs"), message, ("generator",), nearest(muscle.springs, groups)))
        numbers = muscle.springs if isinstance(muscle.springs, tuple) else ()
        for n, number in enumerate(numbers):
            if net.spring_count is not None and number >= net.spring_count:
                message = f"there is no spring {number}: there are {net.spring_count}, counted from 0"
                found.append(Mistake(("muscles", k, "springs", n), message, ("springs", "generator", "muscles")))
    return found[:_MOST_TOLD]


def triangle_mistakes(triangles: Sequence[tuple[int, int, int]], count: int) -> list[Mistake]:
    """Return a mistake for each triangle that has a point twice, or one that does not exist."""
    found = []
    for k, triangle in enumerate(triangles):
        if max(triangle) >= count:
            message = f"there is no point {max(triangle)}: there are {count}, counted from 0"
            found.append(Mistake(("triangles", k, triangle.index(max(triangle))), message, ("triangles", "points")))
        elif len(set(triangle)) < 3:
            found.append(Mistake(("triangles", k), "a triangle has three points, each once", ("triangles",)))
    return found[:_MOST_TOLD]
