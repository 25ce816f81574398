"""The weighted-residual scheme on whole arrays, written from its equations; nothing is skipped.

Arrays are (rows, columns), padded by two ghosts where said so; what is done along y is done along x of the
transposes.
"""

from typing import NamedTuple

import numpy as np
from dense_pressure import earth_pressure, stretching

from solver.physics.friction import Voellmy

RETAINED, EMPTIED, STILL, YIELD_TOLERANCE = 1e-12, 0.75, 1e-4, 1 + 1e-12
INNER = np.s_[2:-2, 2:-2]


class State(NamedTuple):
    h: np.ndarray
    u: np.ndarray
    v: np.ndarray


class Flux(NamedTuple):
    mass: np.ndarray
    normal: np.ndarray
    tangential: np.ndarray
    pressure: np.ndarray


def leaving_at_depth(leaving, h, depth, beta, fastest=np.inf):
    """Outward velocity beyond a side of given depth, by what the flow inside sends out."""
    inside, outside = np.sqrt(beta * h), np.sqrt(beta * depth)
    by_invariant = np.maximum(leaving + 2 * (inside - outside), -outside)
    # a layer that comes in faster than its waves is slower outside, by what it gains as it thins
    layer = np.minimum(np.maximum(np.maximum(leaving, -fastest), leaving + 2 * (outside - inside)), -outside)
    found = np.where((leaving < -inside) & (h >= depth / 2), layer, by_invariant)
    return np.where((leaving >= inside) & (inside > 0), leaving, found)


def along_at_depth(along, depth, beta, forth, back):
    """Velocity along a side of given depth beyond it: no more than that of waves or of the layer there."""
    waves = np.sqrt(beta * depth)
    return np.clip(along, -np.maximum(back, waves), np.maximum(forth, waves))


def raised_by_fall(rate, carried, falling):
    """Rate whose step moves nothing farther than waves may go with the velocity of its end."""
    return np.maximum(rate, (carried + np.sqrt(carried**2 + 4 * falling**2)) / 2)


def before(side, h, n, t, rise, beta, fastest=np.inf, beside=(np.inf, np.inf)):
    """Two ghosts before the first column; n is the velocity along the rows, rise gains depth at a wall."""
    mirrored = side in ("wall", "no-slip")
    mode = "symmetric" if mirrored else "edge"
    h, n, t = (np.pad(q, ((0, 0), (2, 0)), mode=mode) for q in (h, n, t))
    if mirrored:
        n[:, :2] *= -1
        h[:, :2] = np.minimum(np.maximum(0, h[:, :2] + rise[:, None] * [3, 1]), 2 * h[:, :2])
    if side == "no-slip":
        t[:, :2] *= -1
    if not isinstance(side, str):
        n[:, :2] = -leaving_at_depth(-n[:, 2], h[:, 2], side, beta, fastest)[:, None]
        t[:, :2] = along_at_depth(t[:, 2], side, beta, *beside)[:, None]
        h[:, :2] = side
    return h, n, t


def flipped(state):
    """Turn the rows round, and with them the velocity along them."""
    h, n, t = (q[:, ::-1] for q in state)
    return State(h, -n, t)


def transposed(state):
    return State(state.h.T, state.v.T, state.u.T)


def padded(state, sides, rises=(0.0, 0.0), betas=(1.0, 1.0, 1.0, 1.0), fastest=4 * (np.inf,)):
    """Ghosts on all four sides: x_min, x_max, y_min, y_max, each "open", "wall", "no-slip" or a depth.

    rises : gain of depth per spacing toward the walls at x_min and x_max, one or a row each. betas : g cos xi
    K of the outermost cells at every side, those at y_min and y_max with the ghosts beside them. fastest :
    speeds along x, y and against them of layers beyond given depths at most.
    """
    gains = [np.broadcast_to(q, len(state.h)) for q in rises]
    for k in (0, 2):
        beside = fastest[2 - k], fastest[3 - k]
        state = before(sides[k], *state, gains[0], betas[k], fastest[k], beside)
        state = flipped(before(sides[k + 1], *flipped(state), gains[1], betas[k + 1], fastest[k + 1], beside))
        state = transposed(State(*state))
        gains = [np.zeros(len(state.h))] * 2
    return State(*(np.ascontiguousarray(q) for q in state))


def limited(wanted, behind, ahead, steepness):
    """Step of a wanted size, bounded by the differences to both neighbours."""
    most = steepness / 2 * np.minimum(np.abs(behind), np.abs(ahead))
    return np.where(behind * ahead > 0, np.sign(ahead) * np.minimum(wanted, most), 0.0)


def steepness_of(behind, ahead, slips=False):
    """Minmod where the flow loses at least half its speed, and where a cell slips between two at rest."""
    return np.where(slips | (behind - ahead > np.minimum(np.abs(behind), np.abs(ahead))), 1.0, 2.0)


def steps_to_faces(back, forth, steepness):
    """To the low and the high face by (-1 5 2)/6 of means, limited."""
    low = limited(np.abs(1 / 3 * back + 1 / 6 * forth), -forth, -back, steepness)
    return low, limited(np.abs(1 / 6 * back + 1 / 3 * forth), back, forth, steepness)


def at_rear(h, behind, ahead, n, steepness):
    """Whether a flow ends behind a cell that moves to deeper ones."""
    return (behind <= h / 2) & (ahead > 1.5 * h) & (n > 0) & (steepness > 1)


def face_state(cell, at_face, beyond, behind, sign, dry):
    """Bounds on depth and on the velocities, given as steps from the mean, and the front rule.

    What is nearly all at the face that it leaves through leaves with the mean velocity. A front has no depth
    toward a dry cell before it has 0.45 of what lies behind, leads it, and is no more than a front faster.
    """
    (h, n, t), (depth, n_step, t_step), (h_behind, n_behind, wave) = cell, at_face, behind
    faster = np.maximum(0, sign * (n - n_behind)) ** 2
    # up to the mean where it has come off what is behind, from which 1e-4 of its velocity does not tell it
    told = faster + 1e-8 * n**2
    share = (faster - 4 * np.maximum(0, wave)) / np.where(told > 0, told, 1)
    depth = np.maximum(depth, np.where(sign * n > 0, h * np.maximum(0.1, share), 0))
    led = (sign * n <= 0) | ((sign * n_behind > 0) & (faster <= 4 * wave))
    part = np.where((depth > 1.9 * h) & (sign * (n + n_step) > 0), 0, 1)
    hidden = (beyond <= dry) & (h < 0.45 * h_behind) & led
    return np.where(hidden, 0.0, depth), n + part * n_step, t + part * t_step


def face_values(h, n, t, dry, beta):
    """Low and high values of h, n, t along the rows; a dry neighbour has no velocity to differ by."""
    one, own, other = np.s_[:, :-2], np.s_[:, 1:-1], np.s_[:, 2:]
    near = [h[one], h[own], h[other]]
    beside = [[np.where(h[k] > dry, q[k], q[own]) for k in (one, own, other)] for q in (n, t)]
    rest = [(beside[0][k] == 0) & (beside[1][k] == 0) for k in (0, 2)]
    steepness = steepness_of(beside[0][0], beside[0][2], rest[0] & rest[1] & (n[own] != 0))
    steps = [
        steps_to_faces(here - behind, ahead - here, most)
        for (behind, here, ahead), most in zip((near, *beside), (steepness, steepness, 2.0), strict=True)
    ]
    # at a rear depth is halfway to the cell ahead, and four times the mean at most
    for k, beyond, behind, sign in ((0, one, other, -1), (1, other, one, 1)):
        rear = at_rear(h[own], h[behind], h[beyond], sign * n[own], steepness)
        steps[0][k][rear] = np.minimum((h[beyond] - h[own]) / 2, 3 * h[own])[rear]
    wave, cell = np.broadcast_to(beta, h.shape) * h, (h[own], n[own], t[own])
    faces = [
        face_state(
            cell,
            (h[own] + steps[0][k], steps[1][k], steps[2][k]),
            h[beyond],
            (h[behind], n[behind], wave[behind]),
            2 * k - 1,
            dry,
        )
        for k, beyond, behind in ((0, one, other), (1, other, one))
    ]
    return [q for pair in zip(*faces, strict=True) for q in pair]


def hll(a, p, s, b, q, t, c_a, c_b, static_a, static_b, dry):
    """Harten, Lax & van Leer between (depth, normal, tangential) = (a, p, s) and (b, q, t), wave speeds c."""
    slow = np.minimum(np.minimum(np.where(a > dry, p - c_a, q - 2 * c_b), q - c_b), 0)
    fast = np.maximum(np.maximum(np.where(b > dry, q + c_b, p + 2 * c_a), p + c_a), 0)
    width = np.where(fast > slow, fast - slow, 1.0)

    def mean(f_a, f_b, jump):
        return (fast * f_a - slow * f_b + fast * slow * jump) / width

    mass, impulse = mean(a * p, b * q, b - a), mean(a * p**2, b * q**2, b * q - a * p)
    pressure = mean(a**2, b**2, 0) / 2
    # from a static cell only what its neighbour pushes toward it crosses the face
    from_b = mass < 0
    giver_static, taker_static = np.where(from_b, static_b, static_a), np.where(from_b, static_a, static_b)
    depth, speed = np.where(from_b, a, b), np.where(from_b, p, q)
    pushes = (np.where(from_b, speed, -speed) > 0) & (taker_static == 0)
    held = (giver_static > 0) & (mass != 0)
    entering = np.where(pushes, depth * speed, 0.0)
    mass = np.where(held, entering, mass)
    normal = np.where(held, entering * speed, impulse)
    pressure = np.where(held, np.where(giver_static == 2, depth, np.minimum(a, b)) ** 2 / 2, pressure)
    return Flux(mass, normal, mass * np.where(mass > 0, s, t), pressure)


def bounded(flux, h, n, t, beta, low, high):
    """What boundary faces may carry; h, n, t, beta of the inner cells, whose flux is given."""
    mass, normal, tangential, pressure = (q.copy() for q in flux)
    for side, k, outward in ((low, 0, -1), (high, -1, 1)):
        if side == "open":
            enters = outward * mass[:, k] < 0
            for q in (mass, normal, tangential):
                q[enters, k] = 0
        if side in ("wall", "no-slip"):
            mass[:, k] = tangential[:, k] = 0
        if side == "no-slip":
            drag = h * (np.abs(n) + np.sqrt(beta * h)) * t
            tangential[:, k] = outward * drag[:, k]
    return Flux(mass, normal, tangential, pressure)


def fluxes(state, beta, static, low, high, dry):
    """Fluxes along the rows through all faces of the inner cells; all arrays padded."""
    h, n, t, beta, static = (q[2:-2] for q in (*state, beta, static))
    h_low, h_high, n_low, n_high, t_low, t_high = face_values(h, n, t, dry, beta)
    c = np.sqrt(beta * h)
    flux = hll(
        *(q[:, :-1] for q in (h_high, n_high, t_high)),
        *(q[:, 1:] for q in (h_low, n_low, t_low)),
        c[:, 1:-2],
        c[:, 2:-1],
        static[:, 1:-2],
        static[:, 2:-1],
        dry,
    )
    return bounded(flux, *(q[:, 2:-2] for q in (h, n, t, beta)), low, high)


def out_of(mass):
    """What leaves each cell through its two faces along the rows."""
    return np.maximum(mass[:, 1:], 0) - np.minimum(mass[:, :-1], 0)


def outflow_limits(h, x_mass, y_mass, dt, dx, dy):
    """Share of the depth that it has that a cell would lose."""
    loss = dt / dx * out_of(x_mass) + dt / dy * out_of(y_mass.T).T
    return loss / np.where(h > 0, h, 1.0)


def afforded(flux, lost, n, t):
    """Leave a cell the RETAINED-th part of its depth, and what is left of it up to twice its velocity."""
    acts, carries = (lost > EMPTIED) & (flux.mass != 0), np.where(flux.mass != 0, flux.mass, 1.0)
    part = np.minimum(lost, 1 - RETAINED)
    mass = np.where(acts, flux.mass * part / np.where(acts, lost, 1.0), flux.mass)
    more = (np.abs(n) + np.abs(t)) * (1 - part) / np.where(acts, part, 1.0)
    normal, tangential = (
        np.where(acts, mass * np.clip(q / carries, mean - more, mean + more), q)
        for q, mean in ((flux.normal, n), (flux.tangential, t))
    )
    return Flux(mass, normal, tangential, flux.pressure)


def scaled(flux, lost, n, t):
    """What the cells that fluxes along the rows leave can afford."""

    def giver(q):
        around = np.pad(q, ((0, 0), (1, 1)))
        return np.where(flux.mass > 0, around[:, :-1], np.where(flux.mass < 0, around[:, 1:], 0.0))

    return afforded(flux, giver(lost), giver(n), giver(t))


def difference(q):
    return q[:, :-1] - q[:, 1:]


def in_stage(start, now, part):
    """What cells can give in a stage: depth, and the velocity of all of it."""
    kept = (1 / part - 1) * start.h
    had = now.h + kept
    over = 1 / np.where(had > 0, had, 1.0)
    return State(had, *((now.h * q + kept * q_0) * over for q, q_0 in ((now.u, start.u), (now.v, start.v))))


def bounded_film(state, dry, most):
    """A film is as fast as the deeper cells beside it at most; most is the square of their speed."""
    square = state.u**2 + state.v**2
    faster = square > most * YIELD_TOLERANCE
    share = np.where(faster, np.sqrt(most / np.where(faster, square, 1.0)), 1.0)
    share = np.where(state.h > dry, 1.0, np.where(most > 0, share, 0.0))
    return State(state.h, share * state.u, share * state.v)


def loaded(before, after):
    """Depth that gravity and friction act on: that before a stage, but at most twice that after it."""
    return np.minimum(before, 2 * np.maximum(after, 0))


def classify(state, along, normal, law, tangent, dry, dx, dy):
    """beta_x, beta_y, static of all but the outermost cells, and the largest wave rate of wet ones."""
    mid, e, w = np.s_[1:-1, 1:-1], np.s_[1:-1, 2:], np.s_[1:-1, :-2]
    n, s = np.s_[2:, 1:-1], np.s_[:-2, 1:-1]
    h, u, v = (q[mid] for q in state)
    wet = h > dry
    may_flow = wet | (u != 0) | (v != 0)

    along, normal = along[1:-1], normal[1:-1]

    def stretched(q, ahead, behind, d):
        forth, back = (
            np.where(state.h[place] > dry, sign * (q[place] - q[mid]), 0) / d
            for place, sign in ((ahead, 1), (behind, -1))
        )
        rise = (state.h[ahead] - state.h[behind]) / (2 * d)
        return stretching((forth + back) / 2, (forth - back) / 2, rise), np.abs(rise)

    (u_x, h_x), (v_y, h_y) = stretched(state.u, e, w, dx), stretched(state.v, n, s, dy)
    fall = np.where(wet, np.sqrt(np.maximum(h, 0) / normal), 0)
    beta_x, beta_y, *waves = earth_pressure(law, u_x, v_y, fall, normal, (h_x, h_y))
    x = [beta_x * (h - state.h[w]) / dx - along, beta_x * (state.h[e] - h) / dx - along]
    y = [beta_y * (h - state.h[s]) / dy, beta_y * (state.h[n] - h) / dy]
    steep_x, steep_y = np.maximum(*np.abs(x)), np.maximum(*np.abs(y))
    drive = np.maximum(np.hypot(steep_x, sum(y) / 2), np.hypot(sum(x) / 2, steep_y))
    held = (drive <= normal * tangent * YIELD_TOLERANCE) & (u == 0) & (v == 0)
    static = np.where(may_flow, np.where(held, 2.0, 0.0), 1.0)
    c_x, c_y = (
        wave + np.sqrt(wave**2 + beta * h) for wave, beta in zip(waves, (beta_x, beta_y), strict=True)
    )
    rate = (np.abs(u) + c_x) / dx + (np.abs(v) + c_y) / dy
    return beta_x, beta_y, static, np.where(may_flow, rate, 0.0)


class Twin:
    """A scene stepped by a dense scheme; the state is (depth, velocity along and across) at all points.

    x, y : places of the bed that a state, or a padded one, stands on. widths : rate along x of a unit speed.
    films : whether what is dry moves on beside a flow.
    """

    films = True

    def __init__(self, scene, arrival_depth, x, y, widths=1.0):
        self.scene, self.arrival_depth, bounds = scene, arrival_depth, scene.boundaries
        self.time, self.steps, self.rest_time, self.ledger = 0.0, 0, np.nan, np.zeros((4, 2))
        self.sides = bounds.x_min, bounds.x_max, bounds.y_min, bounds.y_max
        given = [side for side in self.sides if not isinstance(side, str)]
        self.dry = scene.scheme.wet_limit * max(scene.depth.max(), *given, 0)
        wet = scene.depth > self.dry
        velocity = scene.velocity_x, scene.velocity_y
        self.state = State(scene.depth.copy(), *(np.where(wet, q, 0.0) for q in velocity))
        # given depths of these scenes are on level ground
        self.fastest = [float(np.max(sign * q)) for q in self.state[1:] for sign in (1, -1)]
        self.tangent = np.tan(np.radians(scene.friction.bed_friction))
        turbulent = isinstance(scene.friction, Voellmy)
        self.drag = scene.gravity / scene.friction.turbulent_friction if turbulent else 0.0
        # earth-pressure coefficients at rest
        self.at_rest = earth_pressure(scene.earth_pressure, 0, 0, 0, 1, (0, 0))[:2]
        self.along, self.normal = self.gravity(x, y)
        self.curvature = scene.terrain.curvature(x, y)
        excess = np.maximum(0, np.abs(self.along) - self.tangent * self.normal)
        self.falling = np.sqrt(scene.scheme.cfl * excess * widths)
        along, normal = self.gravity(np.array(scene.points.x, float), np.full(2, float(scene.points.y[0])))
        self.excess = np.sign(along) * np.maximum(0, np.abs(along) - self.tangent * normal)
        shape = scene.depth.shape
        self.max_depth, self.max_speed, self.max_flux = np.zeros((3, *shape))
        self.arrival = np.full(shape, np.nan)
        self.record()

    def gravity(self, x, y):
        xi = self.scene.terrain.inclination(x, y)
        return self.scene.gravity * np.sin(xi), self.scene.gravity * np.cos(xi)

    @property
    def shown(self):
        """The state with what is dry at rest."""
        dry = self.state.h <= self.dry
        return State(self.state.h, *(np.where(dry, 0.0, q) for q in self.state[1:]))

    @property
    def rest_volume(self):
        return self.scene.scheme.rest_share * self.released

    def record(self):
        h, u, v = self.state
        square = np.where(h > self.dry, u**2 + v**2, 0.0)
        self.max_depth = np.maximum(self.max_depth, h)
        self.max_speed = np.maximum(self.max_speed, np.sqrt(square))
        self.max_flux = np.maximum(self.max_flux, h * square)
        self.arrival[np.isnan(self.arrival) & (h > self.arrival_depth)] = self.time

    def updated(self, source, gains, load, bed, part, dt):
        """U_0 + part (U_1 - U_0 + dt gains), then friction on a load and drag over part dt.

        bed : normal load and curvature.
        """
        (h_0, u_0, v_0), (h_1, u_1, v_1), (normal, curvature) = self.state, source, bed
        start, there, time = (h_0, h_0 * u_0, h_0 * v_0), (h_1, h_1 * u_1, h_1 * v_1), part * dt
        h, hu, hv = (
            q_0 + part * (q_1 - q_0 + dt * gain) for q_0, q_1, gain in zip(start, there, gains, strict=True)
        )
        if self.films:
            ran_dry = (h <= self.dry) & (dt * gains[0] <= h_1)
            hu, hv = np.where(ran_dry, h * u_1, hu), np.where(ran_dry, h * v_1, hv)
        wet = h > (STILL * self.dry if self.films else self.dry)
        depth = np.where(wet, h, 1.0)
        u, v = (np.where(wet, q / depth, 0.0) for q in (hu, hv))
        speed = np.hypot(u, v)
        loss = time * self.tangent * np.maximum(0, normal + curvature * u_1**2) * load / depth
        left = np.where(speed > loss * YIELD_TOLERANCE, speed - loss, 0.0)
        # the positive root of left = speed' + time drag speed'^2 / h
        left = 2 * left / (1 + np.sqrt(1 + 4 * time * self.drag * left / depth))
        slowed = np.where(wet & (speed > 0), left / np.where(speed > 0, speed, 1.0), 0.0)
        return State(h, slowed * u, slowed * v)

    def step(self, dt):
        """One step of eq. 14."""
        one = self.stage(self.state, 1.0, 1 / 6, dt)
        two = self.stage(one, 1 / 4, 1 / 6, dt)
        self.state = self.stage(two, 2 / 3, 2 / 3, dt)
        self.steps += 1

    def advance(self, target):
        """Step to a time, or until next to nothing moves."""
        while self.time < target:
            rate, moving = self.classify()
            unmoved = self.steps > 0 and not self.state.u.any() and not self.state.v.any()
            if moving <= self.rest_volume or (unmoved and moving < np.inf):
                self.rest_time = self.time
                self.state = State(self.state.h, *np.zeros((2, *self.state.h.shape)))
                return
            left = target - self.time
            dt = min(self.scene.scheme.cfl / rate if rate > 0 else left, left)
            if dt < left < 2 * dt:
                dt = left / 2
            self.step(dt)
            self.time = target if dt == left else self.time + dt
            self.record()


class Run(Twin):
    """A scene on a lattice; the state has no ghosts between steps."""

    def __init__(self, scene, arrival_depth=0.0):
        lattice = scene.points
        self.dx, self.dy, self.drained = lattice.dx, lattice.dy, 0
        x = np.pad(lattice.x_points, 2, mode="edge")
        super().__init__(scene, arrival_depth, x, np.full_like(x, lattice.y_points.mean()), 1 / lattice.dx)
        padding = np.ones((lattice.shape[0] + 4, 1))
        self.beta_x, self.beta_y = (padding * self.normal * k for k in self.at_rest)
        self.released = self.state.h.sum() * self.dx * self.dy

    def surrounded(self, state):
        """Pad a state by its ghosts."""
        west, east = self.beta_x[2:-2, 2], self.beta_x[2:-2, -3]
        rises = -self.excess[0] / west * self.dx, self.excess[1] / east * self.dx
        betas = west, east, self.beta_y[2], self.beta_y[-3]
        return padded(state, self.sides, rises, betas, self.fastest)

    def classify(self):
        """Set padded beta_x, beta_y and static; return the largest wave rate and the volume that moves."""
        all_ = self.surrounded(self.state)
        square = np.where(all_.h > self.dry, all_.u**2 + all_.v**2, 0.0)
        beside = square[2:-2, 1:-3], square[2:-2, 3:-1], square[1:-3, 2:-2], square[3:-1, 2:-2]
        self.state = bounded_film(self.state, self.dry, np.max(beside, axis=0))
        all_ = self.surrounded(self.state)
        material = self.scene.earth_pressure, self.tangent, self.dry
        *status, rates = classify(all_, self.along, self.normal, *material, self.dx, self.dy)
        rates = rates[1:-1, 1:-1]
        status = [np.pad(q[1:-1, 1:-1], 2, mode="edge") for q in status]
        # a step is as long as gravity lets it be
        carried = np.abs(self.state.u) / self.dx + np.abs(self.state.v) / self.dy
        rate = np.where(rates > 0, raised_by_fall(rates, carried, self.falling[2:-2]), 0).max()
        self.beta_x, self.beta_y, self.static = status
        driven = False
        normal = np.broadcast_to(self.normal, self.static.shape)
        along = np.broadcast_to(self.along, self.static.shape)
        views = [
            (np.s_[2:-2, 2], np.s_[2:-2, 1], self.beta_x, self.dx, -1),
            (np.s_[2:-2, -3], np.s_[2:-2, -2], self.beta_x, self.dx, 1),
            (np.s_[2, 2:-2], np.s_[1, 2:-2], self.beta_y, self.dy, 0),
            (np.s_[-3, 2:-2], np.s_[-2, 2:-2], self.beta_y, self.dy, 0),
        ]
        for side, (cell, ghost, beta, d, outward) in zip(self.sides, views, strict=True):
            if isinstance(side, str):
                continue
            drive = np.abs(beta[cell] * (side - all_.h[cell]) / d - outward * along[cell])
            pushes = (drive > normal[cell] * self.tangent * YIELD_TOLERANCE) & (side > self.dry)
            held = (self.static[ghost] == 1) & (side > self.dry)
            self.static[ghost] = np.select([pushes, held], [0.0, 2.0], self.static[ghost])
            rate = max(rate, (pushes * 2 * np.sqrt(beta[cell] * side) / d).max())
            driven |= (self.static[ghost] == 0).any()
        moving = (self.state.h * (self.static[INNER] == 0)).sum() * self.dx * self.dy
        return rate, np.inf if driven else moving

    def stop_at_walls(self, normal, source, dt):
        """Walls across the bed take from what is too thin to lean on them at most what stops it."""
        for side, k, cell, way in ((0, 0, 2, -1), (1, -1, -3, 1)):
            if self.sides[side] in ("wall", "no-slip"):
                h, u = source.h[:, k], source.u[:, k]
                thin = way * self.excess[side] * self.dx / self.beta_x[2:-2, cell] > h
                most = h * np.maximum(0, way * u) * self.dx / dt
                normal[:, k] = np.where(thin, np.minimum(normal[:, k], most), normal[:, k])

    def stage(self, source, part, share, dt):
        """U_0 + part (U_1 - U_0 + dt L(U_1)), then friction over part dt."""
        h_1, all_ = source.h, self.surrounded(source)
        x = fluxes(all_, self.beta_x, self.static, *self.sides[:2], self.dry)
        y = fluxes(transposed(all_), self.beta_y.T, self.static.T, *self.sides[2:], self.dry)
        self.stop_at_walls(x.normal, source, dt)
        has = in_stage(self.state, source, part)
        lost = outflow_limits(has.h, x.mass, y.mass.T, dt, self.dx, self.dy)
        self.drained += int((lost > EMPTIED).sum())
        x, y = scaled(x, lost, has.u, has.v), scaled(y, lost.T, has.v.T, has.u.T)
        for k, (mass, length) in enumerate(((x.mass, self.dy), (y.mass, self.dx))):
            for side, leaving in ((2 * k, -mass[:, 0]), (2 * k + 1, mass[:, -1])):
                self.ledger[side, 1] += share * dt * length * np.maximum(leaving, 0).sum()
                self.ledger[side, 0] -= share * dt * length * np.minimum(leaving, 0).sum()
        y = Flux(*(q.T for q in y))
        free = self.static[INNER] != 2
        left = has.h + dt * (difference(x.mass) / self.dx + difference(y.mass.T).T / self.dy)
        load = loaded(h_1, left)
        # pressure acts on the same share of what was there
        acting = np.where(load < h_1, load / np.where(h_1 > 0, h_1, 1.0), 1.0)
        beta_x, beta_y = acting * self.beta_x[INNER], acting * self.beta_y[INNER]
        gravity = self.along[2:-2] * load
        force_x = beta_x * difference(x.pressure) / self.dx + gravity
        force_y = beta_y * difference(y.pressure.T).T / self.dy
        gains = [
            difference(along) / self.dx + difference(across.T).T / self.dy + free * force
            for along, across, force in (
                (x.mass, y.mass, 0.0),
                (x.normal, y.tangential, force_x),
                (x.tangential, y.normal, force_y),
            )
        ]
        return self.updated(source, gains, load, (self.normal[2:-2], self.curvature[2:-2]), part, dt)


def simulate(scene, times, arrival_depth=0.0):
    """A finished run, and its frames: depth and velocities of shape (nt, ny, nx)."""
    run = Run(scene, arrival_depth)
    frames = []
    for time in times:
        if np.isnan(run.rest_time):
            run.advance(time)
        frames.append(run.shown)
    return run, State(*(np.stack(q) for q in zip(*frames, strict=True)))
