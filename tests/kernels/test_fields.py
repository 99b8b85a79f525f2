"""Flow primitives and force fields against their twins, every kind, core and law of the registries."""

import numpy as np
import pytest
import warp as wp

from tests.reference import flow as flow_reference
from tests.reference import forces as force_reference
from tests.reference.flow import Primitive, unit
from tests.reference.forces import Field
from warpsim.directions import across
from warpsim.kernels import flow, forces
from warpsim.kernels.environment import drag_rate, sample_velocities
from warpsim.kernels.forces import ForceField, sample_acceleration
from warpsim.kernels.grids import OUTSIDES
from warpsim.kernels.primitive import CORES, FlowPrimitive
from warpsim.scene.expressions import PLACE, compile_expression
from warpsim.scene.flow import Core
from warpsim.scene.forces import Attractor
from warpsim.signals import SignalTable

WHERE = {"center": (0.3, -0.2, 0.5), "axis": (1.0, 2.0, -0.5), "direction": (0.3, 0.1, 1.0), "half_length": 0.7, "radius": 2.0}
NOISE = {"length": 0.7, "seed": 12345, "clock": 0x12345678}
NODES = np.random.default_rng(5).normal(size=(3, 4, 5, 3)).astype(np.float32)
FORMULAS = ("sin(3*x)*y - t", "(x^2 + z^2 + 1)^-0.5 * exp(-abs(y))", "min(x, step(y, z)) + tanh(t*z)")


@wp.kernel
def sample_accelerations(
    table: wp.array2d[ForceField], gravity: wp.vec3, inverse_mass: float, points: wp.array[wp.vec3], a_out: wp.array[wp.vec3]
):
    i = wp.tid()
    a_out[i] = sample_acceleration(table, 0, gravity, inverse_mass, points[i])


def flow_row(p: Primitive) -> FlowPrimitive:
    row = FlowPrimitive()
    row.kind, row.core, row.core_radius = list(flow.FLOWS).index(p.type), CORES[p.core], p.core_radius
    row.center, row.axis, row.direction = wp.vec3(*p.center), wp.vec3(*unit(p.axis)), across(p.axis, p.direction)
    row.half_length, row.radius, row.time = p.half_length, p.radius, p.time
    row.length, row.seed, row.clock = p.length, p.seed, p.clock
    row.strength = wp.vec3(*p.strength) if isinstance(p.strength, tuple) else wp.vec3(p.strength, 0.0, 0.0)
    row.nodes = wp.vec3i(*p.nodes.shape[:3])
    row.inverse_spacing, row.outside = wp.vec3(*(1.0 / h for h in p.spacing)), OUTSIDES[p.outside]
    if p.type == "doublet":
        row.strength = row.direction * p.strength  # its moment
    return row


def force_row(f: Field) -> ForceField:
    row = ForceField()
    row.kind, row.law = list(forces.FORCES).index(f.type), forces.ATTRACTOR_LAWS[f.law]
    row.center, row.softening, row.strength = wp.vec3(*f.center), f.softening, wp.vec3(f.strength, 0.0, 0.0)
    return row


def velocities(primitives, points, device) -> np.ndarray:
    rows, signals = [flow_row(p) for p in primitives], SignalTable()
    for row, p in zip(rows, primitives, strict=True):
        spans = [signals.add_program(compile_expression(text, PLACE)) for text in p.formulas]
        row.span = wp.vec4i(*[begin for begin, _ in spans], spans[-1][1])
    program = signals.tables(device).program
    for row, p in zip(rows, primitives, strict=True):
        row.program, row.values = program, wp.array(p.nodes.ravel(), dtype=float, device=device)
    table = wp.array(rows, dtype=FlowPrimitive, device=device).reshape((1, len(primitives)))
    planar = wp.array(np.ascontiguousarray(points.T), dtype=float, device=device)
    out = wp.zeros_like(planar)
    wp.launch(sample_velocities, len(points), [0, table, planar, out], device=device)
    return out.numpy().T.astype(float)


def accelerations(fields, gravity, mass, points, device) -> np.ndarray:
    table = wp.array([force_row(f) for f in fields], dtype=ForceField, device=device).reshape((1, len(fields)))
    out = wp.zeros(len(points), dtype=wp.vec3, device=device)
    inputs = [table, wp.vec3(*gravity), 1.0 / mass, wp.array(points, dtype=wp.vec3, device=device), out]
    wp.launch(sample_accelerations, len(points), inputs, device=device)
    return out.numpy().astype(float)


def strength_of(kind: str):
    return (0.4, -1.0, 2.0) if kind == "uniform" else -1.7


def primitives() -> list:
    """Every kind; a vortex once for every core."""
    cases = []
    for kind in flow.FLOWS:
        for core in CORES if kind.startswith("vortex") else ("ideal",):
            for outside in OUTSIDES if kind == "grid" else ("zero",):
                p = Primitive(kind, strength_of(kind), **WHERE, core=core, core_radius=0.6, formulas=FORMULAS, time=0.4, **NOISE)
                p.nodes, p.spacing, p.outside = NODES, (0.9, 0.8, 0.7), outside
                cases.append(pytest.param(p, id=f"{kind}-{core}-{outside}"))
    return cases


def close(got, exact, rtol, scale=None):
    """Relative to the vector's length, and not to each component: a rotated frame would have others."""
    length = np.linalg.norm(exact, axis=1) if scale is None else scale
    assert (np.linalg.norm(got - exact, axis=1) <= rtol * length).all(), (np.linalg.norm(got - exact, axis=1) / length).max()


def test_every_kind_core_and_law_has_a_twin():
    assert set(flow_reference.FLOWS) == set(flow.FLOWS) and set(flow_reference.CORES) == set(CORES)
    assert set(force_reference.FORCES) == set(forces.FORCES) and set(force_reference.ATTRACTOR_LAWS) == set(forces.ATTRACTOR_LAWS)
    assert set(CORES) == set(Core.model_fields["model"].annotation.__args__)
    assert set(forces.ATTRACTOR_LAWS) == set(Attractor.model_fields["law"].annotation.__args__)


@pytest.mark.parametrize("primitive", primitives())
def test_primitive_equals_the_twin(primitive, rng, device):
    """At 257 points 0.1 to 4 m away: x − center is rounded to 2^-24 · 4 m, of 0.1 m that is 2.4e-6; the rest is a dozen roundings."""
    a = unit(primitive.axis)
    out = rng.normal(size=(257, 3))
    out -= np.outer(out @ a, a)
    out *= (np.geomspace(0.1, 4.0, 257) / np.linalg.norm(out, axis=1))[:, None]
    points = (np.asarray(primitive.center) + out + np.outer(rng.uniform(-1, 1, 257), a)).astype(np.float32)
    exact = np.array([flow_reference.sample([primitive], x) for x in points])
    # A noise has still points, where the rounding of what cancels there is left: it is measured against its own size.
    scale = np.maximum(np.linalg.norm(exact, axis=1), abs(primitive.strength)) if primitive.type == "curl_noise" else None
    close(velocities([primitive], points, device), exact, 6e-6, scale)


@pytest.mark.parametrize("primitive", primitives())
def test_primitive_is_finite_on_its_singularity(primitive, device):
    points = np.array([primitive.center, primitive.center], np.float32) + np.array([[0, 0, 0], [1e-20, 0, 0]], np.float32)
    assert np.isfinite(velocities([primitive], points, device)).all()


def test_superposition_is_the_sum_in_order(rng, device):
    """To rounding: each of the partial sums to 2^-24 of the terms' sizes."""
    members = [case.values[0] for case in primitives()]
    points = rng.uniform(1.0, 4.0, (257, 3)).astype(np.float32)
    each = [velocities([p], points, device) for p in members]
    size = sum(np.linalg.norm(v, axis=1) for v in each)
    close(velocities(members, points, device), sum(each), len(members) * 2.0**-23, size)
    close(velocities(members, points, device), np.array([flow_reference.sample(members, x) for x in points]), 6e-6, size)


def test_no_primitives_is_still_air(rng, device):
    points = rng.normal(size=(257, 3)).astype(np.float32)
    assert (velocities([], points, device) == 0.0).all()
    assert (accelerations([], (1.0, -9.81, 0.5), 1.0, points, device).astype(np.float32) == np.float32([1.0, -9.81, 0.5])).all()


@pytest.mark.parametrize("law", forces.ATTRACTOR_LAWS)
def test_attractor_equals_the_twin(law, rng, device):
    """Points 0.1 m to 4 m away: x − C rounds to 2.4e-6 of 0.1 m as above, tripled by the inverse square's power."""
    fields = [Field("attractor", 1.3, (0.3, -0.2, 0.5), law, 0.05), Field("attractor", -0.4, (-5.0, 0.0, 1.0), law)]
    direction = rng.normal(size=(257, 3))
    points = direction * (np.geomspace(0.1, 4.0, 257) / np.linalg.norm(direction, axis=1))[:, None] + fields[0].center
    points = points.astype(np.float32)
    exact = np.array([force_reference.acceleration(fields, (0.0, -9.81, 0.0), 0.02, x) for x in points])
    size = np.array([np.linalg.norm(force_reference.acceleration([f], (0, 0, 0), 0.02, x)) for f in fields for x in points])
    close(accelerations(fields, (0.0, -9.81, 0.0), 0.02, points, device), exact, 1e-5, size.reshape(2, -1).sum(axis=0) + 9.81)


@pytest.mark.parametrize("law", forces.ATTRACTOR_LAWS)
def test_attractor_is_finite_and_small_at_its_center(law, device):
    """With softening ε the pull at the center itself vanishes; near it, it grows at most like k d/ε³."""
    points = np.array([[0, 0, 0], [1e-9, 0, 0]], np.float32)
    got = accelerations([Field("attractor", 1.0, law=law)], (0.0, 0.0, 0.0), 1.0, points, device)
    assert (got[0] == 0.0).all() and np.isfinite(got).all() and abs(got[1, 0]) <= 1.01


def test_drag_rate_is_that_of_stokes():
    assert drag_rate(0.02, 0.0, 1e-3, 1.0 / 0.5) == pytest.approx(0.04, rel=1e-6)
    assert drag_rate(0.0, 1.8e-5, 1e-3, 1.0 / 1e-6) == pytest.approx(6 * np.pi * 1.8e-5 * 1e-3 / 1e-6, rel=1e-6)
