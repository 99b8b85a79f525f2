"""Events that an emitter may listen to, and the order in which systems move so that each hears of what happened before it."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from warpsim.scene.base import Mistake, Name, Number, Spec, Truth, mistakes
from warpsim.scene.nearest import listed, nearest


class Inheritance(Spec):
    """What a child takes on from the particle it is born of."""

    velocity: Annotated[Number, Field(ge=0.0, le=1.0)] = Field(
        1.0, description="Share of the particle's velocity at the event (at a collision, along the surface) on top of the child's own [1]."
    )
    color: Truth = Field(False, description="Whether the child's color is multiplied with the particle's own color.")


class On(Spec):
    """What makes the emitter give birth: something that happens to a particle of another system, at its exact place and moment."""

    event: Literal["birth", "death", "collision"] = Field(
        description="birth; death: at the end of its lifetime, or by a collider that kills it (not by leaving the scene's extent); "
        "collision: the first impact of a frame."
    )
    of: Name = Field(description="The system to whose particles it happens.")
    min_speed: Annotated[Number, Field(ge=0.0, le=1e9)] | None = Field(
        None, description="Of collisions, the least speed toward the surface that counts; absent: any [m/s]."
    )
    axes: Literal["world", "surface"] = Field(
        "world", description="Axes of the emitter's shape and velocity; surface: at a collision, with y along the surface's normal."
    )
    inherit: Inheritance = Field(Inheritance(), description="What the children take on from the particle.")

    @model_validator(mode="after")
    def _keys_fit_the_event(self):
        found = []
        if self.event != "collision" and self.min_speed is not None:
            found.append(Mistake(("min_speed",), f"only collisions have a speed toward a surface, not a {self.event}", ("event",)))
        if self.event != "collision" and self.axes == "surface":
            found.append(Mistake(("axes",), f"only collisions happen on a surface, not a {self.event} (leave out axes)", ("event",)))
        if found:
            raise mistakes(found)
        return self


Hearing = tuple[tuple[str | int, ...], On]


def hearings(systems: Mapping[str, Any]) -> dict[str, list[Hearing]]:
    """Return for each system that listens the place and the content of each `on` of its emitters."""
    found: dict[str, list[Hearing]] = {}
    for name, system in systems.items():
        for k, emitter in enumerate(getattr(system, "emitters", ())):
            if emitter.on is not None:
                found.setdefault(name, []).append((("systems", name, "emitters", k, "on"), emitter.on))
    return found


def events_of(name: str, systems: Mapping[str, Any]) -> list[On]:
    """Return what is listened to of one system, each kind of event once."""
    kinds: dict[tuple, On] = {}
    for heard in hearings(systems).values():
        for _, on in heard:
            if on.of == name:
                kinds.setdefault(kind_of(on), on)
    return list(kinds.values())


def kind_of(on: On) -> tuple:
    """Return what tells two kinds of events of one system apart."""
    return on.event, on.min_speed


def has_colors(system: Any) -> bool:
    """Whether the particles of a system have colors of their own."""
    return any(emitter.color or (emitter.on is not None and emitter.on.inherit.color) for emitter in getattr(system, "emitters", ()))


def in_order(systems: Mapping[str, Any]) -> list[str]:
    """Return the systems' names, each after those it listens to, else as they are written; members of a circle come last."""
    parents = {name: {on.of for _, on in heard} for name, heard in hearings(systems).items()}
    order: list[str] = []
    while ready := [name for name in systems if name not in order and parents.get(name, set()) & set(systems) <= set(order)]:
        order.append(ready[0])
    return order + [name for name in systems if name not in order]


def companies(systems: Mapping[str, Any]) -> dict[str, str]:
    """Return for each system the name of its company: those that hear of, or see, one another, directly or through others."""
    company = {name: name for name in systems}
    heard = hearings(systems)
    for name, system in systems.items():
        for other in {on.of for _, on in heard.get(name, ())} | set(getattr(system, "attends", ())):
            merged = company[name], company[other]
            company = {each: merged[0] if its in merged else its for each, its in company.items()}
    return company


def event_mistakes(scene: Any) -> list[Mistake]:
    """Return a mistake for each event of a scene that cannot be heard, or that never happens."""
    found, systems = [], scene.systems
    heard = hearings(systems)
    for name, entries in heard.items():
        for path, on in entries:
            found += _mistakes_of(name, path, on, systems) or _never_collides(path, on, scene)
    return found or _circles(heard, systems)


def _mistakes_of(name: str, path: tuple, on: On, systems: Mapping[str, Any]) -> list[Mistake]:
    others = [other for other in systems if other != name]
    if on.of == name:
        message = f"a system cannot listen to itself: put these emitters into a system of their own{_known(others)}"
        return [Mistake((*path, "of"), message, ("systems",))]
    if on.of not in systems:
        return [Mistake((*path, "of"), f'there is no system "{on.of}"{_known(others)}', ("systems",), nearest(on.of, others))]
    if not hasattr(systems[on.of], "emitters"):
        others = [other for other in others if hasattr(systems[other], "emitters")]
        message = f'nothing is born or dies in "{on.of}", which is of type {systems[on.of].type}{_known(others, "particle system")}'
        return [Mistake((*path, "of"), message, ("systems",))]
    if on.inherit.color and not has_colors(systems[on.of]):
        message = f'"{on.of}" has no colors of its own to inherit: its emitters need a color'
        return [Mistake((*path, "inherit", "color"), message, ("systems",))]
    return []


def _never_collides(path: tuple, on: On, scene: Any) -> list[Mistake]:
    if on.event != "collision":
        return []
    parent, depends = scene.systems[on.of], ("systems", "colliders")
    if parent.motion == "ballistic":
        message = f'"{on.of}" moves in closed form (motion: ballistic) and meets no collider: take motion: dynamic'
    elif not scene.colliders:
        message = "the scene has no colliders: nothing collides"
    elif parent.feels.colliders in (False, ()):
        message = f'"{on.of}" feels no colliders: nothing of it collides (see its feels)'
    else:
        return []
    return [Mistake((*path, "event"), message, depends)]


def _known(names: list[str], kind: str = "system") -> str:
    return f" (other {kind}s: {listed(names)})" if names else f" (the scene has no other {kind})"


def _circles(heard: dict[str, list[Hearing]], systems: Mapping[str, Any]) -> list[Mistake]:
    """Return a mistake for one `on` of each circle of systems that wait for each other."""
    parents = {name: [(path, on.of) for path, on in entries] for name, entries in heard.items()}
    found, told = [], set()
    for name in systems:
        way = _way_back(name, parents)
        if way and not told & set(way):
            told |= set(way)
            path = next(path for path, of in parents[name] if of == way[1])
            message = f"systems cannot listen in a circle: {' to '.join(way)}; one of them must not listen to the next"
            found.append(Mistake((*path, "of"), message, ("systems",)))
    return found


def _way_back(name: str, parents: dict[str, list]) -> list[str]:
    """Return the shortest way of listening from a system to itself, both ends included; empty if there is none."""
    ways, seen = [[name]], set()
    while ways:
        way = ways.pop(0)
        for _, of in parents.get(way[-1], ()):
            if of == name:
                return [*way, name]
            if of not in seen:
                seen.add(of)
                ways.append([*way, of])
    return []
