"""Multistep: Heun's, the Adams–Bashforth and the Adams–Bashforth–Moulton methods, for particles with inertia and for tracers.

The drive N is what past values are kept of: a + k u [m/s²] for a particle with inertia, u [m/s] for a tracer. Over a substep it is a
polynomial through its past values (and, to correct, the one at the predicted place), under which the motion is exact
(exponential.py). For tracers and for k → ∞ these are the classical methods for x' = u, without drag Adams' methods in Falkner's form for
x'' = a. Fewer past values than the order asks for, or a substep of which the body lives a part only: one step by Runge–Kutta.
"""

import warp as wp

WHOLE = 0.9999  # of a substep counts as all of it: a birth "on the step" is rounded
FIRST_SHARE = {2: 1.0 / 6.0, 4: 19.0 / 270.0}  # Milne: the corrected value's local error over its distance from the predicted one
SECOND_SHARE = {2: 1.0 / 4.0, 4: 17.0 / 152.0}  # the same for a second integral, by Falkner's constants 1/8, −1/24; 3/32, −17/1440
SIXTH = 1.0 / 6.0


def whole_formula(real):
    """Make the test for a whole substep in one precision."""

    @wp.func(inline=True)
    def whole_step(h: real, dt: real) -> int:
        """Return 1 if the body lives through the whole substep."""
        return wp.where(h > dt * real(WHOLE), 1, 0)

    return whole_step


class Form:
    """How a body with inertia, or a tracer, moves: what multistep methods are made of beside the kit.

    drive(body); drive_at(environment, moment, body, x); move(body, n1, n2, n3, h); arrive(body, moment, environment): feel the fields at
    the new place; start(x, v, u, a, k, inverse_mass, internal, coupled, moment, stride, h, environment): a step by Runge–Kutta from a
    moment on; share: of the position error in the distance of the two positions, by order.
    """

    def __init__(self, drive, drive_at, move, arrive, start, share):
        self.drive, self.drive_at, self.move, self.arrive, self.start, self.share = drive, drive_at, move, arrive, start, share


def inertial_form(kit) -> Form:
    """Make the second-order form x' = v, v' = −k v + N in one precision."""
    real, vec, Body, Environment, flow, acceleration = kit.real, kit.vec, kit.Body, kit.Environment, kit.flow, kit.acceleration
    arrive, glides = kit.feel_everything, kit.glides
    weights, driven, pull = glides.exponential_weights, glides.driven, glides.pull
    glide_position, glide_velocity = glides.glide_position, glides.glide_velocity

    @wp.func
    def drive(body: Body) -> vec:
        """Return the drive at the body's place [m/s²]."""
        return driven(body.a, body.u, body.k)

    @wp.func
    def drive_at(environment: Environment, moment: int, body: Body, x: vec) -> vec:
        """Return the drive at x [m/s²]."""
        return driven(acceleration(environment, moment, body, x), flow(environment, moment, x), body.k)

    @wp.func
    def move(body: Body, n1: vec, n2: vec, n3: vec, h: real) -> Body:
        """Return the body after h under a cubic drive with those derivatives."""
        w = weights(body.k * h)
        g = pull(drive(body), body.v, body.k)
        x = glide_position(body.x, body.v, g, n1, n2, n3, w, h)
        body.v = glide_velocity(body.v, g, n1, n2, n3, w, h)
        body.x = x
        return body

    return Form(drive, drive_at, move, arrive, inertial_start(kit, drive, drive_at, move), SECOND_SHARE)


def inertial_start(kit, drive, drive_at, move):
    """Make the one-step method of the second-order form in one precision."""
    real, vec, Body, Environment, arrive, glides = kit.real, kit.vec, kit.Body, kit.Environment, kit.feel_everything, kit.glides
    weights, pull, glide_position = glides.exponential_weights, glides.pull, glides.glide_position
    middle_slope, middle_bend = glides.middle_slope, glides.middle_bend

    @wp.func
    def start_inertial(
        x: vec,
        v: vec,
        u: vec,
        a: vec,
        k: real,
        inverse_mass: real,
        internal: vec,
        coupled: int,
        moment: int,
        stride: int,
        h: real,
        environment: Environment,
    ) -> Body:
        """Step of order 4: moved by the parabola through three drives.  Source: Nyström 1925, here with φ-functions."""
        body = Body()
        body.x = x
        body.v = v
        body.u = u
        body.a = a
        body.k = k
        body.inverse_mass = inverse_mass
        body.internal = internal
        body.coupled = coupled
        still = vec()
        half = real(0.5) * h
        n = drive(body)
        y = glide_position(x, v, pull(n, v, k), still, still, still, weights(k * half), half)
        middle = drive_at(environment, moment + stride, body, y)
        y = glide_position(x, v, pull(middle, v, k), still, still, still, weights(k * h), h)
        end = drive_at(environment, moment + 2 * stride, body, y)
        body = move(body, middle_slope(n, middle, end), middle_bend(n, middle, end), still, h)
        body = arrive(body, moment + 2 * stride, environment)
        body.velocity_error = wp.length(drive(body) - end) * (h * real(SIXTH))  # by the drive at the true end: of order 3, too much
        return body

    return start_inertial


def tracer_form(kit) -> Form:
    """Make the first-order form x' = u in one precision."""
    real, vec, Body, Environment, flow, follow = kit.real, kit.vec, kit.Body, kit.Environment, kit.flow, kit.glides.follow

    @wp.func
    def drive(body: Body) -> vec:
        """Return the flow at the body's place [m/s]."""
        return body.u

    @wp.func
    def drive_at(environment: Environment, moment: int, body: Body, x: vec) -> vec:
        """Return the flow at x [m/s]."""
        return flow(environment, moment, x)

    @wp.func
    def move(body: Body, n1: vec, n2: vec, n3: vec, h: real) -> Body:
        """Return the body after h in a cubic flow with those derivatives."""
        body.x = follow(body.x, body.u, n1, n2, n3, h)
        return body

    @wp.func
    def arrive(body: Body, moment: int, environment: Environment) -> Body:
        """Return the body with the flow at its place, which is its velocity."""
        body.u = flow(environment, moment, body.x)
        body.v = body.u
        return body

    return Form(drive, drive_at, move, arrive, tracer_start(kit, arrive), FIRST_SHARE)


def tracer_start(kit, arrive):
    """Make the one-step method of the first-order form in one precision."""
    real, vec, Body, Environment, flow, drift = kit.real, kit.vec, kit.Body, kit.Environment, kit.flow, kit.drift

    @wp.func
    def start_tracer(
        x: vec,
        v: vec,
        u: vec,
        a: vec,
        k: real,
        inverse_mass: real,
        internal: vec,
        coupled: int,
        moment: int,
        stride: int,
        h: real,
        environment: Environment,
    ) -> Body:
        """Step of the classical Runge–Kutta method.  Source: Kutta 1901."""
        body = Body()
        dx = u
        w = flow(environment, moment + stride, drift(x, u, real(0.5) * h))
        dx = drift(dx, w, real(2.0))
        w = flow(environment, moment + stride, drift(x, w, real(0.5) * h))
        dx = drift(dx, w, real(2.0))
        w = flow(environment, moment + 2 * stride, drift(x, w, h))
        body.x = drift(x, drift(dx, w, real(1.0)), h / real(6.0))
        body = arrive(body, moment + 2 * stride, environment)
        body.position_error = wp.length(body.u - w) * (h * real(SIXTH))  # by the flow at the true end: of order 3, too much
        return body

    return start_tracer


def polynomials(kit, order: int):
    """Make the derivatives of the drive's polynomial of one order in one precision: through the past, and through what lies ahead."""
    vec, Body, glides = kit.vec, kit.Body, kit.glides
    first_difference, second_difference, third_difference = glides.first_difference, glides.second_difference, glides.third_difference
    first_slope, second_slope = glides.first_slope, glides.second_slope
    Slopes = wp.types.matrix(shape=(3, 3), dtype=kit.real)

    @wp.func
    def slopes(d1: vec, d2: vec, d3: vec) -> Slopes:
        """Return the rows n₁, n₂, n₃ from backward differences."""
        return wp.matrix_from_rows(first_slope(d1, d2, d3), second_slope(d2, d3), d3)

    @wp.func
    def past_slopes(body: Body, n: vec) -> Slopes:
        """Return the derivatives by n, now, and the past values."""
        d1 = vec()
        d2 = vec()
        d3 = vec()
        if order > 1:
            d1 = first_difference(n, body.past1)
        if order > 2:
            d2 = second_difference(n, body.past1, body.past2)
        if order > 3:
            d3 = third_difference(n, body.past1, body.past2, body.past3)
        return slopes(d1, d2, d3)

    @wp.func
    def slopes_ahead(body: Body, n: vec, ahead: vec) -> Slopes:
        """Return the derivatives by the value ahead, n, and the past values: the difference of the highest order is the newer one."""
        if order > 3:
            d3 = third_difference(ahead, n, body.past1, body.past2)
            return slopes(first_difference(n, body.past1), second_difference(n, body.past1, body.past2), d3)
        return slopes(first_difference(ahead, n), vec(), vec())

    return past_slopes, slopes_ahead


def remembering(kit):
    """Make what a body remembers of a substep in one precision."""
    vec, Body = kit.vec, kit.Body

    @wp.func
    def remember(body: Body, drive: vec, whole: int) -> Body:
        """Return the body with the drive at the substep's beginning as its latest past value; a substep lived in part is no past."""
        body.past3 = body.past2
        body.past2 = body.past1
        body.past1 = drive
        body.kept = wp.where(whole == 1, wp.min(body.kept + 1, 3), 0)
        return body

    return remember


def one_step(kit, form: Form):
    """Make the substep of a body whose past does not suffice in one precision."""
    real, Body, Environment, start = kit.real, kit.Body, kit.Environment, form.start

    @wp.func
    def step_once(body: Body, s: int, h: real, environment: Environment) -> Body:
        """Return the body after one step by Runge–Kutta."""
        moment = 2 * s * body.stride
        after = start(
            body.x, body.v, body.u, body.a, body.k, body.inverse_mass, body.internal, body.coupled, moment, body.stride, h, environment
        )
        body.x = after.x
        body.v = after.v
        body.u = after.u
        body.a = after.a
        body.position_error = after.position_error
        body.velocity_error = after.velocity_error
        return body

    return step_once


def adams(kit, form: Form, order: int, corrects: bool):
    """Make the substep of one Adams method in one precision; order is that of the polynomial through the past."""
    real, Body, Environment, whole_step = kit.real, kit.Body, kit.Environment, kit.whole_step
    drive, drive_at, move, arrive = form.drive, form.drive_at, form.move, form.arrive
    remember, step_once = remembering(kit), one_step(kit, form)
    past_slopes, slopes_ahead = polynomials(kit, order)
    velocity_share, position_share = FIRST_SHARE.get(order, 0.0), form.share.get(order, 0.0)

    @wp.func
    def step_adams(body: Body, s: int, h: real, environment: Environment) -> Body:
        """Predict with the polynomial through the past; correct with that through what lies ahead.  Source: Bashforth & Adams 1883."""
        n = drive(body)
        whole = whole_step(h, body.dt)
        if order == 1 or (whole == 1 and body.kept >= order - 1):
            moment = (2 * s + 2) * body.stride
            c = past_slopes(body, n)
            next = move(body, c[0], c[1], c[2], h)
            if corrects:
                predicted = next
                c = slopes_ahead(body, n, drive_at(environment, moment, body, predicted.x))
                next = move(body, c[0], c[1], c[2], h)
                next.position_error = wp.length(next.x - predicted.x) * real(position_share)
                next.velocity_error = wp.length(next.v - predicted.v) * real(velocity_share)
            body = arrive(next, moment, environment)
        else:
            body = step_once(body, s, h, environment)
        return remember(body, n, whole)

    return step_adams


def forms(kit) -> dict[str, Form]:
    """Make both forms in one precision, by the prefix of their methods' names."""
    return {"": inertial_form(kit), "tracer_": tracer_form(kit)}


def multistep_methods(kit, forms: dict[str, Form]) -> dict:
    """Make Heun's, Adams–Bashforth's and Moulton's methods in both forms in one precision."""
    made = {}
    for prefix, form in forms.items():
        feel = kit.feel_flow if prefix else kit.feel_everything
        made[f"{prefix}heun"] = (feel, adams(kit, form, 1, True))
        made |= {f"{prefix}adams_bashforth_{order}": (feel, adams(kit, form, order, False)) for order in (2, 3, 4)}
        made |= {f"{prefix}abm_pece_{order}": (feel, adams(kit, form, order, True)) for order in (2, 4)}
    return made
