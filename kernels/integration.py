"""Integration: one substep of one particle, one method each; advance.py runs them through the frame.

Symbols: x position [m], v velocity [m/s], u flow at x [m/s], a acceleration by gravity and forces [m/s²], k drag rate [1/s],
h the part of the substep in which the particle lives [s]. Moment 2s of the tables is the beginning of substep s, 2s + 1 its
middle. The native loops (loops.py) follow these line by line; tests hold the two equal to the bit. The functions here that are no
device code make the methods in one precision: float32 for the frame, float64 for the measurement of their orders (convergence.py).
"""

import warp as wp

from warpsim.kernels.elementary import mean_decay
from warpsim.kernels.environment import Environment, sample_felt_acceleration
from warpsim.kernels.exponential import GLIDES32
from warpsim.kernels.flow import sample_flow
from warpsim.kernels.multistep import forms, multistep_methods, whole_formula

LARGEST_SPEED = wp.constant(1.0e30)  # [m/s]: beyond it counts as not finite


@wp.struct
class Pace:
    dt: float  # substep [s]
    fps: float  # frames per second
    substep_count: int  # per frame
    first: int  # a launch runs the substeps first … last − 1 of them
    last: int


def body_struct(real, vec):
    """Make the state of one particle in one precision."""

    @wp.struct
    class Body:
        x: vec  # [m]
        v: vec  # [m/s]
        u: vec  # flow at x [m/s], where the method keeps it from one substep to the next
        a: vec  # acceleration by gravity and forces at x [m/s²], likewise
        past1: vec  # drive (multistep.py) one, two and three substeps ago
        past2: vec
        past3: vec
        kept: int  # how many of them there are
        stride: int  # moments of the tables per half substep
        position_error: real  # estimate of the substep's own, where the method makes one [m]
        velocity_error: real  # [m/s]
        internal: vec  # acceleration by the neighbors, constant through the launch [m/s²]
        coupled: int  # 1: there is an internal acceleration
        dead: int  # 1: killed within the frame, stays where it died
        age: real  # at the frame's end [s]
        lifetime: real  # [s]
        dt: real  # the whole substep [s]
        inverse_mass: real  # [1/kg]
        k: real  # drag rate [1/s]

    return Body


def formulas(real, vec, mean_decay):
    """Make the two moves that every one-step method is made of in one precision, then what a kick is made of."""

    @wp.func(inline=True)
    def felt_time(k: real, h: real) -> real:
        """Return h φ(kh), how long an acceleration counts whose effect dies away with k [s]; h, to the bit, without drag."""
        return h * mean_decay(k * h)

    @wp.func(inline=True)
    def push(v: vec, u: vec, a: vec, k: real, felt: real) -> vec:
        """Return the velocity that an acceleration and the drag have made of v in a felt time [m/s]."""
        return v + (a + (u - v) * k) * felt

    @wp.func(inline=True)
    def kick(v: vec, u: vec, a: vec, k: real, h: real) -> vec:
        """Return v + h φ(kh)(a + k(u − v)), exact for constant u and a, stable for any h.  Source: Hochbruck & Ostermann 2010, §2.1."""
        return push(v, u, a, k, felt_time(k, h))

    @wp.func(inline=True)
    def drift(x: vec, v: vec, h: real) -> vec:
        """Return x + h v."""
        return x + v * h

    return kick, drift, push, felt_time


Body = body_struct(float, wp.vec3)
kick, drift, push, felt_time = formulas(float, wp.vec3, mean_decay)


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
def flow_at(environment: Environment, moment: int, x: wp.vec3) -> wp.vec3:
    """Return the flow at x [m/s]."""
    return sample_flow(environment.flow, moment, x)


@wp.func
def acceleration_at(environment: Environment, moment: int, body: Body, x: wp.vec3) -> wp.vec3:
    """Return gravity, the forces per mass at x, and what the neighbors do [m/s²]."""
    a = sample_felt_acceleration(environment, moment, body.inverse_mass, x)
    if body.coupled == 1:
        a = a + body.internal
    return a


class Kit:
    """What methods are made of, in one precision: types, the two moves, the glides, and the fields they sample.

    `flow(environment, moment, x)` and `acceleration(environment, moment, body, x)` read the environment at a moment, in half substeps.
    """

    def __init__(self, real, vec, Body, Environment, moves, glides, flow, acceleration):
        self.real, self.vec, self.Body, self.Environment = real, vec, Body, Environment
        (self.kick, self.drift), self.glides, self.flow, self.acceleration = moves, glides, flow, acceleration
        self.whole_step = whole_formula(real)
        self.feel_nothing, self.feel_flow, self.feel_everything = self._feelings()

    def _feelings(self):
        Body, Environment, flow, acceleration = self.Body, self.Environment, self.flow, self.acceleration

        @wp.func
        def feel_nothing(body: Body, moment: int, environment: Environment) -> Body:
            """Return the body as it is: the method keeps nothing from one substep to the next."""
            return body

        @wp.func
        def feel_flow(body: Body, moment: int, environment: Environment) -> Body:
            """Return the body with the flow at its place."""
            body.u = flow(environment, moment, body.x)
            return body

        @wp.func
        def feel_everything(body: Body, moment: int, environment: Environment) -> Body:
            """Return the body with the flow and the acceleration at its place."""
            body.u = flow(environment, moment, body.x)
            body.a = acceleration(environment, moment, body, body.x)
            return body

        return feel_nothing, feel_flow, feel_everything


def euler_methods(kit: Kit) -> dict:
    """Make the three Euler methods in one precision."""
    real, Body, Environment, kick, drift = kit.real, kit.Body, kit.Environment, kit.kick, kit.drift
    flow, acceleration = kit.flow, kit.acceleration

    @wp.func
    def step_euler(body: Body, s: int, h: real, environment: Environment) -> Body:
        """Explicit Euler: position and velocity both from the old state.  Source: Euler 1768."""
        u = flow(environment, 2 * s, body.x)
        a = acceleration(environment, 2 * s, body, body.x)
        body.x = drift(body.x, body.v, h)
        body.v = kick(body.v, u, a, body.k, h)
        return body

    @wp.func
    def step_drift_kick(body: Body, s: int, h: real, environment: Environment) -> Body:
        """Symplectic Euler that moves first: forces at the new position.  Source: Hairer, Lubich & Wanner 2006, I.1.2."""
        body.x = drift(body.x, body.v, h)
        u = flow(environment, 2 * s + 2, body.x)
        a = acceleration(environment, 2 * s + 2, body, body.x)
        body.v = kick(body.v, u, a, body.k, h)
        return body

    @wp.func
    def step_semi_implicit_euler(body: Body, s: int, h: real, environment: Environment) -> Body:
        """Symplectic Euler that kicks first, the lecture's: forces at the old position, then the new velocity moves it."""
        u = flow(environment, 2 * s, body.x)
        a = acceleration(environment, 2 * s, body, body.x)
        body.v = kick(body.v, u, a, body.k, h)
        body.x = drift(body.x, body.v, h)
        return body

    nothing = kit.feel_nothing
    return {
        "euler": (nothing, step_euler),
        "drift_kick": (nothing, step_drift_kick),
        "semi_implicit_euler": (nothing, step_semi_implicit_euler),
    }


def symmetric_methods(kit: Kit) -> dict:
    """Make Verlet's and Kutta's methods in one precision."""
    real, vec, Body, Environment, kick, drift = kit.real, kit.vec, kit.Body, kit.Environment, kit.kick, kit.drift
    acceleration, feel_everything = kit.acceleration, kit.feel_everything

    @wp.func
    def step_verlet(body: Body, s: int, h: real, environment: Environment) -> Body:
        """Velocity Verlet: half a kick, a drift, half a kick.  Source: Swope et al. 1982."""
        v = kick(body.v, body.u, body.a, body.k, real(0.5) * h)
        body.x = drift(body.x, v, h)
        body = feel_everything(body, 2 * s + 2, environment)
        body.v = kick(v, body.u, body.a, body.k, real(0.5) * h)
        return body

    @wp.func
    def step_rk4(body: Body, s: int, h: real, environment: Environment) -> Body:
        """Classical Runge–Kutta under the forces, between two halves of the drag (Strang splitting).  Source: Kutta 1901; Strang 1968."""
        still = vec()
        x0 = body.x
        v0 = kick(body.v, body.u, still, body.k, real(0.5) * h)
        dx = v0
        dv = body.a
        x = drift(x0, v0, real(0.5) * h)
        v = drift(v0, body.a, real(0.5) * h)
        a = acceleration(environment, 2 * s + 1, body, x)
        dx = drift(dx, v, real(2.0))
        dv = drift(dv, a, real(2.0))
        x = drift(x0, v, real(0.5) * h)
        v = drift(v0, a, real(0.5) * h)
        a = acceleration(environment, 2 * s + 1, body, x)
        dx = drift(dx, v, real(2.0))
        dv = drift(dv, a, real(2.0))
        x = drift(x0, v, h)
        v = drift(v0, a, h)
        a = acceleration(environment, 2 * s + 2, body, x)
        body.x = drift(x0, drift(dx, v, real(1.0)), h / real(6.0))
        v = drift(v0, drift(dv, a, real(1.0)), h / real(6.0))
        body = feel_everything(body, 2 * s + 2, environment)
        body.v = kick(v, body.u, still, body.k, real(0.5) * h)
        return body

    return {"verlet": (feel_everything, step_verlet), "rk4": (feel_everything, step_rk4)}


def tracer_methods(kit: Kit) -> dict:
    """Make the one-step methods of the first-order form in one precision."""
    real, Body, Environment, drift, flow, feel_flow = kit.real, kit.Body, kit.Environment, kit.drift, kit.flow, kit.feel_flow

    @wp.func
    def step_tracer_euler(body: Body, s: int, h: real, environment: Environment) -> Body:
        """Explicit Euler of dx/dt = u: a particle without inertia.  Source: Euler 1768."""
        body.x = drift(body.x, body.u, h)
        body = feel_flow(body, 2 * s + 2, environment)
        body.v = body.u
        return body

    @wp.func
    def step_tracer_rk4(body: Body, s: int, h: real, environment: Environment) -> Body:
        """Classical Runge–Kutta of dx/dt = u: a particle without inertia.  Source: Kutta 1901."""
        x0 = body.x
        dx = body.u
        u = flow(environment, 2 * s + 1, drift(x0, body.u, real(0.5) * h))
        dx = drift(dx, u, real(2.0))
        u = flow(environment, 2 * s + 1, drift(x0, u, real(0.5) * h))
        dx = drift(dx, u, real(2.0))
        u = flow(environment, 2 * s + 2, drift(x0, u, h))
        body.x = drift(x0, drift(dx, u, real(1.0)), h / real(6.0))
        body = feel_flow(body, 2 * s + 2, environment)
        body.v = body.u
        return body

    return {"tracer_euler": (feel_flow, step_tracer_euler), "tracer_rk4": (feel_flow, step_tracer_rk4)}


def methods(kit: Kit, forms: dict) -> dict:
    """Make all methods in one precision: what each feels before its first substep and after a collision, and one substep of it."""
    return euler_methods(kit) | symmetric_methods(kit) | tracer_methods(kit) | multistep_methods(kit, forms)


KIT = Kit(float, wp.vec3, Body, Environment, (kick, drift), GLIDES32, flow_at, acceleration_at)
FORMS = forms(KIT)
METHODS = methods(KIT, FORMS)
