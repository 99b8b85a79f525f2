"""Integration: one substep of one particle, one method each; advance.py runs them through the frame.

Symbols: x position [m], v velocity [m/s], u flow at x [m/s], a acceleration by gravity and forces [m/s²], k drag rate [1/s],
h the part of the substep in which the particle lives [s]. Moment 2s of the tables is the beginning of substep s, 2s + 1 its
middle. The native loops (loops.py) follow these line by line; tests hold the two equal to the bit.
"""

import warp as wp

from warpsim.kernels.elementary import mean_decay
from warpsim.kernels.environment import Environment, sample_felt_acceleration
from warpsim.kernels.flow import sample_flow

LARGEST_SPEED = wp.constant(1.0e30)  # [m/s]: beyond it counts as not finite


@wp.struct
class Pace:
    dt: float  # substep [s]
    fps: float  # frames per second
    substep_count: int  # per frame
    first: int  # a launch runs the substeps first … last − 1 of them
    last: int


@wp.struct
class Body:
    x: wp.vec3  # [m]
    v: wp.vec3  # [m/s]
    u: wp.vec3  # flow at x [m/s], where the method keeps it from one substep to the next
    a: wp.vec3  # acceleration by gravity and forces at x [m/s²], likewise
    internal: wp.vec3  # acceleration by the neighbors, constant through the launch [m/s²]
    coupled: int  # 1: there is an internal acceleration
    dead: int  # 1: killed within the frame, stays where it died
    age: float  # at the frame's end [s]
    lifetime: float  # [s]
    inverse_mass: float  # [1/kg]
    k: float  # drag rate [1/s]


@wp.func(inline=True)
def kick(v: wp.vec3, u: wp.vec3, a: wp.vec3, k: float, h: float) -> wp.vec3:
    """Return v + h φ(kh)(a + k(u − v)), exact for constant u and a, stable for any h.  Source: Hochbruck & Ostermann 2010, §2.1."""
    return v + (a + (u - v) * k) * (h * mean_decay(k * h))


@wp.func(inline=True)
def drift(x: wp.vec3, v: wp.vec3, h: float) -> wp.vec3:
    """Return x + h v."""
    return x + v * h


@wp.func(inline=True)
def ballistic_position(x: wp.vec3, v: wp.vec3, a: wp.vec3, t: float) -> wp.vec3:
    """Return x + v t + ½ a t², closed form for constant a.  Source: Galilei 1638."""
    return x + (v + a * (0.5 * t)) * t


@wp.func(inline=True)
def inside(x: wp.vec3, v: wp.vec3, extent: float) -> int:
    """Return 1 if the state is finite and within the scene's extent, else 0; a NaN fails every comparison."""
    far = wp.max(wp.max(wp.abs(x[0]), wp.abs(x[1])), wp.abs(x[2]))
    sum = wp.abs(x[0]) + wp.abs(x[1]) + wp.abs(x[2])
    speed = wp.abs(v[0]) + wp.abs(v[1]) + wp.abs(v[2])
    return wp.where(far <= extent, 1, 0) * wp.where(sum < LARGEST_SPEED, 1, 0) * wp.where(speed < LARGEST_SPEED, 1, 0)


@wp.func
def accelerate(environment: Environment, moment: int, body: Body, x: wp.vec3) -> wp.vec3:
    """Return gravity, the forces per mass at x, and what the neighbors do [m/s²]."""
    a = sample_felt_acceleration(environment, moment, body.inverse_mass, x)
    if body.coupled == 1:
        a = a + body.internal
    return a


@wp.func
def feel_nothing(body: Body, moment: int, environment: Environment) -> Body:
    """Return the body as it is: the method keeps nothing from one substep to the next."""
    return body


@wp.func
def feel_flow(body: Body, moment: int, environment: Environment) -> Body:
    """Return the body with the flow at its place."""
    body.u = sample_flow(environment.flow, moment, body.x)
    return body


@wp.func
def feel_everything(body: Body, moment: int, environment: Environment) -> Body:
    """Return the body with the flow and the acceleration at its place."""
    body.u = sample_flow(environment.flow, moment, body.x)
    body.a = accelerate(environment, moment, body, body.x)
    return body


@wp.func
def step_euler(body: Body, s: int, h: float, environment: Environment) -> Body:
    """Explicit Euler: position and velocity both from the old state.  Source: Euler 1768."""
    u = sample_flow(environment.flow, 2 * s, body.x)
    a = accelerate(environment, 2 * s, body, body.x)
    body.x = drift(body.x, body.v, h)
    body.v = kick(body.v, u, a, body.k, h)
    return body


@wp.func
def step_drift_kick(body: Body, s: int, h: float, environment: Environment) -> Body:
    """Symplectic Euler that moves first: forces at the new position.  Source: Hairer, Lubich & Wanner 2006, I.1.2."""
    body.x = drift(body.x, body.v, h)
    u = sample_flow(environment.flow, 2 * s + 2, body.x)
    a = accelerate(environment, 2 * s + 2, body, body.x)
    body.v = kick(body.v, u, a, body.k, h)
    return body


@wp.func
def step_semi_implicit_euler(body: Body, s: int, h: float, environment: Environment) -> Body:
    """Symplectic Euler that kicks first, the lecture's: forces at the old position, then the new velocity moves it."""
    u = sample_flow(environment.flow, 2 * s, body.x)
    a = accelerate(environment, 2 * s, body, body.x)
    body.v = kick(body.v, u, a, body.k, h)
    body.x = drift(body.x, body.v, h)
    return body


@wp.func
def step_verlet(body: Body, s: int, h: float, environment: Environment) -> Body:
    """Velocity Verlet: half a kick, a drift, half a kick.  Source: Swope et al. 1982."""
    v = kick(body.v, body.u, body.a, body.k, 0.5 * h)
    body.x = drift(body.x, v, h)
    body = feel_everything(body, 2 * s + 2, environment)
    body.v = kick(v, body.u, body.a, body.k, 0.5 * h)
    return body


@wp.func
def step_rk4(body: Body, s: int, h: float, environment: Environment) -> Body:
    """Classical Runge–Kutta under the forces, between two halves of the drag (Strang splitting).  Source: Kutta 1901; Strang 1968."""
    still = wp.vec3()
    x0 = body.x
    v0 = kick(body.v, body.u, still, body.k, 0.5 * h)
    dx = v0
    dv = body.a
    x = drift(x0, v0, 0.5 * h)
    v = drift(v0, body.a, 0.5 * h)
    a = accelerate(environment, 2 * s + 1, body, x)
    dx = drift(dx, v, 2.0)
    dv = drift(dv, a, 2.0)
    x = drift(x0, v, 0.5 * h)
    v = drift(v0, a, 0.5 * h)
    a = accelerate(environment, 2 * s + 1, body, x)
    dx = drift(dx, v, 2.0)
    dv = drift(dv, a, 2.0)
    x = drift(x0, v, h)
    v = drift(v0, a, h)
    a = accelerate(environment, 2 * s + 2, body, x)
    body.x = drift(x0, drift(dx, v, 1.0), h / 6.0)
    v = drift(v0, drift(dv, a, 1.0), h / 6.0)
    body = feel_everything(body, 2 * s + 2, environment)
    body.v = kick(v, body.u, still, body.k, 0.5 * h)
    return body


@wp.func
def step_tracer_euler(body: Body, s: int, h: float, environment: Environment) -> Body:
    """Explicit Euler of dx/dt = u: a particle without inertia.  Source: Euler 1768."""
    body.x = drift(body.x, body.u, h)
    body = feel_flow(body, 2 * s + 2, environment)
    body.v = body.u
    return body


@wp.func
def step_tracer_rk4(body: Body, s: int, h: float, environment: Environment) -> Body:
    """Classical Runge–Kutta of dx/dt = u: a particle without inertia.  Source: Kutta 1901."""
    x0 = body.x
    dx = body.u
    u = sample_flow(environment.flow, 2 * s + 1, drift(x0, body.u, 0.5 * h))
    dx = drift(dx, u, 2.0)
    u = sample_flow(environment.flow, 2 * s + 1, drift(x0, u, 0.5 * h))
    dx = drift(dx, u, 2.0)
    u = sample_flow(environment.flow, 2 * s + 2, drift(x0, u, h))
    body.x = drift(x0, drift(dx, u, 1.0), h / 6.0)
    body = feel_flow(body, 2 * s + 2, environment)
    body.v = body.u
    return body


METHODS = {  # what a method needs to know before its first substep and after a collision, and one substep of it
    "euler": (feel_nothing, step_euler),
    "drift_kick": (feel_nothing, step_drift_kick),
    "semi_implicit_euler": (feel_nothing, step_semi_implicit_euler),
    "verlet": (feel_everything, step_verlet),
    "rk4": (feel_everything, step_rk4),
    "tracer_euler": (feel_flow, step_tracer_euler),
    "tracer_rk4": (feel_flow, step_tracer_rk4),
}
