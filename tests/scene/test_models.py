"""The models: defaults, short forms, rules between fields, and a Scene built in Python."""

import numpy as np
import pytest
from pydantic import ValidationError

from tests.scene.samples import EVERYTHING, FOLDER, sample_texts
from warpsim.scene import Formula, Keyframes, Scene, SceneError, describe_field, load_text, resolved_yaml
from warpsim.scene.base import Spec
from warpsim.scene.emitters import Distribution, Emitter, Rate
from warpsim.scene.fields import fixed_length, forms, item_of, keys_of, specs_of
from warpsim.scene.flow import FlowPrimitive
from warpsim.scene.particles import Particles
from warpsim.scene.schema import all_specs


def emitter(**fields) -> Emitter:
    return Emitter.model_validate({"rate": 1, **fields})


def test_the_smallest_scene_has_every_default():
    scene = Scene(name="x")
    assert (scene.seed, scene.time.fps, scene.time.substeps, scene.time.duration, scene.time.prewarm) == (0, 60.0, 4, 10.0, 0.0)
    assert scene.gravity == (0.0, -9.81, 0.0) and scene.flow == () and scene.forces == () and scene.systems == {} and scene.camera is None
    assert (scene.limits.memory, scene.limits.extent, scene.limits.unstable) == (None, 1e6, "stop")


def test_everything_is_read_as_meant():
    scene = load_text(EVERYTHING, folder=FOLDER)
    sparks = scene.systems["sparks"]
    assert sparks.capacity == 200_000 and type(sparks.capacity) is int and sparks.method == "verlet" and sparks.coupling.alpha == 0.02
    assert sparks.feels.flow == ("swirl", 0) and sparks.feels.forces == ("sun",) and sparks.feels.gravity is True
    bowl, rod, box = sparks.emitters
    assert bowl.rate == Rate(mean=20000.0, spread=5000.0, law="scaled_uniform", interval=0.05)
    assert bowl.lifetime == Distribution(mean=2.0, spread=0.5) and bowl.mass == Distribution(mean=1e-3)
    assert [burst.at for burst in rod.burst] == [0.0, 2.5] and rod.rate is None
    assert box.rate.mean == Keyframes(keyframes=((0, 0), (1, 300.5)))
    assert sparks.look.as_ == "sprites" and sparks.look.size.stops == ((0.0, 0.01), (1.0, 0.05))
    assert sparks.look.color.stops[2] == (1.0, (1.0, 0x30 / 255, 0.0, 0.0))
    dust = scene.systems["dust"]
    assert dust.coupling == "tracer" and dust.method == "rk4" and dust.look.color.stops == ((0.0, (1.0, 0.5, 0.25, 1.0)),)
    assert isinstance(dust.emitters[0].rate.mean, Formula) and dust.emitters[0].rate.mean.program[0] == ("constant", 100.0)
    assert scene.flow[4].center == scene.flow[2].center == (0.0, 1.0, 0.0)
    assert scene.flow[0].velocity[1].sine.amplitude == 0.1


@pytest.mark.parametrize("name", sample_texts())
def test_a_resolved_scene_loads_to_an_equal_one(name):
    scene = load_text(sample_texts()[name], name, folder=FOLDER)
    again = load_text(resolved_yaml(scene), name, folder=FOLDER)
    assert again == scene and resolved_yaml(again) == resolved_yaml(scene)


@pytest.mark.parametrize(
    "text", ["no", "1e-3", "010", "0x10", "~", "null", "", " x ", "a: b", "# x", "é\n\ttwo\nlines", "'", '"', "- a", "!x", "&a"]
)
def test_any_text_survives_being_written_out(text):
    scene = Scene(name="x", description=text)
    assert load_text(resolved_yaml(scene)).description == text


@pytest.mark.parametrize(
    ("coupling", "solver", "method"),
    [
        (None, None, "semi_implicit_euler"),
        ("tracer", None, "rk4"),
        ("tracer", "euler", "euler"),
        ({"alpha": 1}, "drift_kick", "drift_kick"),
    ],
)
def test_the_method_is_resolved(coupling, solver, method):
    assert Particles.model_validate({"coupling": coupling, "solver": solver}).method == method


def test_specs_are_frozen_and_may_be_built_in_python():
    e = Emitter(rate=Rate(mean=Formula(expression="t"), spread=1.0), lifetime=Distribution(mean=1.0))
    scene = Scene(name="x", gravity=(0.0, 0.0, 0.0), systems={"p": Particles(capacity=10, emitters=(e,))})
    assert scene.systems["p"].emitters[0] == e
    assert Scene.model_validate({"name": "x", "gravity": [np.float64(0)] * 3}).gravity == (0.0, 0.0, 0.0)
    with pytest.raises(ValidationError):
        scene.seed = 3
    with pytest.raises(ValidationError, match="a tracer has no velocity"):
        Particles(coupling="tracer", solver="verlet")


@pytest.mark.parametrize("value", ["3", True, None, [3], {"mean": 3}, 2.5, float("nan"), float("inf"), -1])
def test_whole_numbers_are_whole_numbers(value):
    with pytest.raises(ValidationError):
        Particles(capacity=value)


@pytest.mark.parametrize("value", ["3", True, None, [3], float("nan"), float("inf")])
def test_numbers_are_numbers(value):
    with pytest.raises(ValidationError):
        Scene.model_validate({"name": "x", "time": {"duration": value}})


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"rate": None}, "needs a rate or a burst"),
        ({"rate": -1}, "must not be negative"),
        ({"rate": {"keyframes": [[0, 1], [1, -1]]}}, "must not be negative"),
        ({"rate": {"mean": 1, "spread": -1}}, "must not be negative"),
        ({"lifetime": 0}, "greater than 0"),
        ({"mass": {"mean": 1, "spread": 1}}, "less than the mean"),
        ({"radius": -1}, "greater than 0"),
        ({"start": 2, "stop": 2}, "must come after start"),
        ({"burst": {"count": 0}}, "greater than or equal to 1"),
        ({"velocity": {"speed": 1, "direction": [0, 0, 0]}}, "must not be zero"),
        ({"velocity": {"speed": 1, "cone": 181}}, "less than or equal to 180"),
        ({"shape": {"type": "box", "size": [1, 0, 1]}}, "greater than 0"),
    ],
)
def test_emitters_refuse_what_cannot_be(fields, says):
    with pytest.raises(ValidationError, match=says):
        emitter(**fields)


def test_emitters_take_what_can_be():
    assert emitter(rate={"sine": {"mean": 0, "amplitude": 5, "period": 1}}).rate.mean.sine.amplitude == 5.0
    assert emitter(burst={"count": 1e3}).burst[0].count == 1000
    assert emitter(lifetime={"mean": 1, "spread": 5, "law": "normal"}).lifetime.spread == 5.0
    assert emitter(rate={"mean": {"expression": "t"}, "law": "poisson"}).rate.law == "poisson"


def test_rules_between_parts_of_the_scene():
    ballistic = {"type": "particles", "motion": "ballistic"}
    attractor = {"type": "attractor", "strength": 1}
    assert Scene.model_validate({"name": "x", "forces": [attractor], "systems": {"p": {**ballistic, "feels": {"forces": False}}}})
    assert Scene.model_validate({"name": "x", "systems": {"p": ballistic}})
    for fields, says in (
        ({"forces": [attractor], "systems": {"p": ballistic}}, "knows gravity only"),
        ({"systems": {"p": {"type": "particles", "feels": {"flow": ["a"]}}}}, 'no "a" in flow'),
        ({"systems": {"p": {"type": "particles", "feels": {"forces": [0]}}}}, "no forces.0"),
        ({"forces": [{**attractor, "name": "a"}] * 2}, "is taken by forces.0"),
        ({"systems": {"p": {"type": "particles", "emitters": [{"rate": 1, "name": "a"}] * 2}}}, "is taken by emitters.0"),
        ({"systems": {"p": {**ballistic, "coupling": "tracer"}}}, "takes no coupling"),
    ):
        with pytest.raises(ValidationError, match=says):
            Scene.model_validate({"name": "x", **fields})


def test_every_flow_primitive_names_its_strength():
    for primitive in FlowPrimitive.__subclasses__():
        assert primitive.strength_field in primitive.model_fields or hasattr(primitive, "programs")


def _fields(spec: type[Spec], inherited: str | None, above: tuple = ()):
    """Yield every field below a spec, with the unit it states or takes from around it."""
    for key, slot in keys_of(spec).items():
        unit = slot.unit or inherited
        yield f"{spec.__name__}.{key}", slot, unit
        for inner in specs_of(slot) or specs_of(item_of(slot) or slot):
            if inner not in above:
                yield from _fields(inner, unit, (*above, inner))


def _is_number(slot) -> bool:
    item = item_of(slot)
    return any(form.annotation in (float, int) for _, form in forms(slot)) or (fixed_length(slot) is not None and _is_number(item))


def test_every_field_is_described_and_every_number_has_a_unit():
    numbers = 0
    for name, slot, unit in _fields(Scene, None):
        assert slot.prose, f"{name} has no description"
        if _is_number(slot):
            numbers += 1
            assert unit, f"{name} has no unit"
    assert numbers > 60


def test_fields_are_described_by_path():
    radius = describe_field("flow.vortex.core.radius")
    assert (radius.unit, radius.minimum, radius.minimum_excluded, radius.required) == ("m", 0.0, True, False)
    assert describe_field("flow.swirl.circulation").unit == describe_field("flow.2.circulation").unit == "m^2/s"
    assert describe_field("systems.sparks.emitters.0.lifetime").default == 5.0
    assert describe_field("systems.particles.solver").choices[-1] == "abm_pece_4" and describe_field("flow").types[0] == "uniform"
    for path, guess in (("flow.vortx", "vortex"), ("tme.fps", "time"), ("time.fsp", "fps"), ("systems.sparks.capcity", "capacity")):
        with pytest.raises(SceneError) as error:
            describe_field(path)
        assert error.value.problems[0].suggestion == guess


def test_spec_names_are_unique():
    # The JSON schema and the reference go by the class's name.
    assert len(all_specs()) == len({spec.__name__ for spec in all_specs().values()})
