"""--set path=value: by keys, names and numbers, in short and long forms; mistakes point into the argument."""

import pytest

from tests.scene.samples import EVERYTHING, FOLDER
from warpsim.scene import SceneError, load_text


def changed(*overrides: str):
    return load_text(EVERYTHING, "s.yaml", overrides, folder=FOLDER)


@pytest.mark.parametrize(
    ("override", "read", "value"),
    [
        ("seed=9", lambda s: s.seed, 9),
        ("time.fps=3e1", lambda s: s.time.fps, 30.0),
        ("gravity=[0, 0, 0]", lambda s: s.gravity, (0.0, 0.0, 0.0)),
        ("gravity.1=-1.62", lambda s: s.gravity, (0.0, -1.62, 0.0)),
        ("flow.swirl.circulation=5", lambda s: s.flow[3].circulation, 5.0),
        ("flow.1.rate=-2", lambda s: s.flow[1].rate, -2.0),
        ("flow.swirl.core.radius=0.5", lambda s: s.flow[3].core.radius, 0.5),
        ("flow.0.velocity.2=1", lambda s: s.flow[0].velocity[2], 1.0),
        ("flow.swirl.circulation.keyframes.1.1=7", lambda s: s.flow[3].circulation.keyframes[1][1], 7.0),
        ("flow.4.strength.sine.phase=0", lambda s: s.flow[4].strength.sine.phase, 0.0),
        ("systems.sparks.emitters.bowl.lifetime.spread=1", lambda s: s.systems["sparks"].emitters[0].lifetime.spread, 1.0),
        ("systems.sparks.emitters.bowl.mass.spread=1e-4", lambda s: s.systems["sparks"].emitters[0].mass.spread, 1e-4),
        ("systems.sparks.emitters.2.rate.spread=5", lambda s: s.systems["sparks"].emitters[2].rate.spread, 5.0),
        ("systems.stones.emitters.0.burst.0.count=7", lambda s: s.systems["stones"].emitters[0].burst[0].count, 7),
        ("systems.fog.emitters.0.burst.count=7", lambda s: s.systems["fog"].emitters[0].burst[0].count, 7),
        ("systems.dust.look.blend=additive", lambda s: s.systems["dust"].look.blend, "additive"),
        ("systems.dust.feels.gravity=false", lambda s: s.systems["dust"].feels.gravity, False),
        ("systems.dust.feels.flow=[swirl]", lambda s: s.systems["dust"].feels.flow, ("swirl",)),
        ("systems.dust={type: particles}", lambda s: s.systems["dust"].emitters, ()),
        ("description= two = words ", lambda s: s.description, "two = words"),
        ("camera=null", lambda s: s.camera, None),
        ("name='3'", lambda s: s.name, "3"),
    ],
)
def test_values_are_set(override, read, value):
    assert read(changed(override)) == value


def test_later_ones_see_earlier_ones():
    scene = changed("flow.swirl.circulation.sine.amplitude=2", "flow.swirl.circulation.sine.period=3")
    assert scene.flow[3].circulation.sine.period == 3.0
    assert changed("systems.dust.capacity=5", "systems.dust.capacity=6").systems["dust"].capacity == 6


def test_what_an_alias_repeats_changes_in_one_place_only():
    scene = changed("flow.4.center.0=9")
    assert scene.flow[4].center == (9.0, 1.0, 0.0) and scene.flow[2].center == (0.0, 1.0, 0.0)


@pytest.mark.parametrize(
    ("override", "column", "suggestion", "says"),
    [
        ("seed", 5, None, "expected path=value"),
        ("=3", 3, None, "expected path=value"),
        ("seed=", 6, None, "a value is missing"),
        ("sed=3", 1, "seed", "has no key"),
        ("systems.fog.emitters.0.burst.cont=7", 30, "count", "has no key"),
        ("systems.fog.emitters.0.color.red=7", 30, None, "has no entry named"),
        ("time.fsp=3", 6, "fps", "has no key"),
        ("flow.swril.rate=3", 6, "swirl", "has no entry named"),
        ("flow.99.rate=3", 6, None, "it has 10"),
        ("flow.swirl.circ=3", 12, "circulation", "has no key"),
        ("systems.spark.capacity=3", 9, "sparks", "has no key"),
        ("systems.sparks.capcity=3", 16, "capacity", "has no key"),
        ("seed.x=3", 6, None, "nothing below it"),
        ("time..fps=3", 6, None, "has no key"),
        ("seed=x", 6, None, "expected a whole number, got the text"),
        ("systems.sparks.capacity=1.5", 25, None, "whole number"),
        ("systems.sparks.coupling={alpah: 3}", 26, "alpha", "unknown key"),
        ("systems.sparks.coupling={alpha: [}", 33, None, "not closed"),
        ("seed=!!int 3", 6, None, "tags"),
        ("seed=1e400", 6, None, "too large"),
        ("flow.swirl.type=vrtex", 17, "vortex", "unknown type"),
        ("flow.swirl.circulation.expression=sn(t)", 35, "sin", "unknown function"),
        ("systems.dust.solver=verlet", 21, None, "one of euler, rk4"),
        ("systems.sparks.feels.flow=[a]", 28, None, "in flow"),
    ],
)
def test_mistakes_point_into_the_argument(override, column, suggestion, says):
    with pytest.raises(SceneError) as error:
        changed("seed=1", override)
    (problem,) = error.value.problems
    assert (problem.file, problem.line) == ("--set 2", 1), str(error.value)
    assert says in problem.message, str(error.value)
    assert problem.column == column and (suggestion is None or problem.suggestion == suggestion), str(error.value)
    assert problem.source_line == override


def test_mistakes_of_file_and_overrides_come_together():
    with pytest.raises(SceneError) as error:
        load_text("name: x\nsed: 3\n", "s.yaml", ("tme.fps=3", "time.fps=-1"))
    assert [problem.file for problem in error.value.problems] == ["s.yaml", "--set 1", "--set 2"]


def test_the_seed_has_the_last_word():
    assert load_text("name: x\nseed: 3\n", "s.yaml", ("seed=4",), seed=5).seed == 5
    with pytest.raises(SceneError, match="from 0 to 4294967295|at least 0"):
        load_text("name: x\n", seed=-1)
