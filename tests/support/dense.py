"""The weighted-residual scheme on whole arrays, written from its equations; nothing is skipped.

Arrays are (rows, columns), padded by two ghosts where said so; what is done along y is done along x of the
transposes.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from solver.physics.friction import Voellmy

RETAINED, YIELD_TOLERANCE = 1e-12, 1 + 1e-12
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


def leaving_at_depth(leaving, h, depth, beta):
    """Outward velocity beyond a side of given depth, by what the flow inside sends out."""
    inside, outside = np.sqrt(beta * h), np.sqrt(beta * depth)
    by_invariant = np.maximum(leaving + 2 * (inside - outside), -outside)
    faster = ((leaving >= inside) & (inside > 0)) | ((leaving < -inside) & (h >= depth / 2))
    return np.where(faster, leaving, by_invariant)


def before(side, h, n, t, rise, beta):
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
        n[:, :2] = -leaving_at_depth(-n[:, 2], h[:, 2], side, beta)[:, None]
        h[:, :2] = side
    return h, n, t


def flipped(state):
    """Turn the rows round, and with them the velocity along them."""
    h, n, t = (q[:, ::-1] for q in state)
    return State(h, -n, t)


def transposed(state):
    return State(state.h.T, state.v.T, state.u.T)


def padded(state, sides, rises=(0.0, 0.0), betas=(1.0, 1.0, 1.0, 1.0)):
    """Ghosts on all four sides: x_min, x_max, y_min, y_max, each "open", "wall", "no-slip" or a depth.

    rises : gain of depth per spacing toward the walls at x_min and x_max, one or a row each. betas : g cos xi
    K of the outermost cells at every side, those at y_min and y_max with the ghosts beside them.
    """
    gains = [np.broadcast_to(q, len(state.h)) for q in rises]
    for k in (0, 2):
        state = before(sides[k], *state, gains[0], betas[k])
        state = flipped(before(sides[k + 1], *flipped(state), gains[1], betas[k + 1]))
        state = transposed(State(*state))
        gains = [np.zeros(len(state.h))] * 2
    return State(*(np.ascontiguousarray(q) for q in state))


def step_to_face(back, forth, near, far, steepness):
    wanted = np.abs(near * back + far * forth)
    most = steepness / 2 * np.minimum(np.abs(back), np.abs(forth))
    return np.where(back * forth > 0, np.sign(back) * np.minimum(wanted, most), 0.0)


def reconstruct(behind, here, ahead, steepness):
    """Low and high face values of cells: (-1 5 2)/6 of means, limited."""
    back, forth = here - behind, ahead - here
    low = here - step_to_face(back, forth, 1 / 3, 1 / 6, steepness)
    return low, here + step_to_face(back, forth, 1 / 6, 1 / 3, steepness)


def of_all(shown, mean, everything):
    """Velocity shown, but the mean of what is nearly all at the face that it leaves through."""
    return np.where(everything, mean, shown)


def follows(n, behind, wave, sign):
    """Whether a front cell is led by what is behind it, and no faster than that can send a front."""
    n, behind = sign * n, sign * behind
    return (n <= 0) | ((behind > 0) & (np.maximum(0, n - behind) ** 2 <= 4 * wave))


def face_values(h, n, t, dry, beta):
    """Low and high values of h, n, t along the rows; a dry neighbour has no velocity to differ by."""
    one, own, other = np.s_[:, :-2], np.s_[:, 1:-1], np.s_[:, 2:]
    (behind, here, ahead), *across = (
        [np.where(h[one] > dry, q[one], q[own]), q[own], np.where(h[other] > dry, q[other], q[own])]
        for q in (n, t)
    )
    stopped = behind - ahead > np.minimum(np.abs(behind), np.abs(ahead))
    steepness = np.where(stopped, 1.0, 2.0)
    low, high = reconstruct(h[one], h[own], h[other], steepness)
    low, high = (
        np.where(sign * here > 0, np.maximum(q, 0.1 * h[own]), q) for q, sign in ((low, -1), (high, 1))
    )
    normal, tangential = reconstruct(behind, here, ahead, steepness), reconstruct(*across[0], 2.0)
    everything = [
        (depth > 1.9 * h[:, 1:-1]) & (sign * shown > 0)
        for depth, shown, sign in ((low, normal[0], -1), (high, normal[1], 1))
    ]
    normal = [of_all(q, n[:, 1:-1], all_) for q, all_ in zip(normal, everything, strict=True)]
    tangential = [of_all(q, t[:, 1:-1], all_) for q, all_ in zip(tangential, everything, strict=True)]
    # a front shows a dry cell no depth before it holds 0.45 of what lies behind
    wave = np.broadcast_to(beta, h.shape) * h
    led = [follows(here, n[:, k], wave[:, k], sign) for k, sign in ((np.s_[2:], -1), (np.s_[:-2], 1))]
    low = np.where((h[:, :-2] <= dry) & (h[:, 1:-1] < 0.45 * h[:, 2:]) & led[0], 0.0, low)
    high = np.where((h[:, 2:] <= dry) & (h[:, 1:-1] < 0.45 * h[:, :-2]) & led[1], 0.0, high)
    return (low, high, *normal, *tangential)


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
    """Share of its outflow that leaves a cell the RETAINED-th part of its depth."""
    loss = dt / dx * out_of(x_mass) + dt / dy * out_of(y_mass.T).T
    most = (1 - RETAINED) * h
    return np.where(loss > most, most / np.where(loss > most, loss, 1.0), 1.0)


def scaled(flux, keep):
    """The part of the fluxes along the rows that the cells they leave can afford."""
    around = np.pad(keep, ((0, 0), (1, 1)), constant_values=1.0)
    share = np.where(flux.mass > 0, around[:, :-1], np.where(flux.mass < 0, around[:, 1:], 1.0))
    return Flux(flux.mass * share, flux.normal * share, flux.tangential * share, flux.pressure)


def difference(q):
    return q[:, :-1] - q[:, 1:]


def loaded(before, after):
    """Depth that gravity and friction act on: that before a stage, but at most twice that after it."""
    return np.minimum(before, 2 * np.maximum(after, 0))


def brake(h_before, u_before, h, u, v, bed, tangent, drag, dry, time):
    """Velocity after a time of friction on the load before, and of drag; bed: normal load and curvature."""
    normal, curvature = bed
    wet = h > dry
    depth = np.where(wet, h, 1.0)
    speed = np.hypot(u, v)
    loss = time * tangent * np.maximum(0, normal + curvature * u_before**2) * h_before / depth
    left = np.where(speed > loss * YIELD_TOLERANCE, speed - loss, 0.0)
    if drag:
        # the positive root of left = speed' + time drag speed'^2 / h
        left = 2 * left / (1 + np.sqrt(1 + 4 * time * drag * left / depth))
    slowed = np.where(wet & (speed > 0), left / np.where(speed > 0, speed, 1.0), 0.0)
    return slowed * u, slowed * v


def classify(state, along, normal, coefficients, tangent, dry, dx, dy):
    """beta_x, beta_y, static of all but the outermost cells, and the largest wave rate of wet ones."""
    x_a, x_p, y_aa, y_ap, y_pa, y_pp = coefficients
    mid, e, w = np.s_[1:-1, 1:-1], np.s_[1:-1, 2:], np.s_[1:-1, :-2]
    n, s = np.s_[2:, 1:-1], np.s_[:-2, 1:-1]
    h, u, v = (q[mid] for q in state)
    wet = h > dry

    def beside(q, place):
        return np.where(state.h[place] > dry, q[place], q[mid])

    extends_x = ~wet | (beside(state.u, e) >= beside(state.u, w))
    extends_y = ~wet | (beside(state.v, n) >= beside(state.v, s))
    along, normal = along[1:-1], normal[1:-1]
    beta_x = normal * np.where(extends_x, x_a, x_p)
    beta_y = normal * np.select([extends_x & extends_y, extends_x, extends_y], [y_aa, y_ap, y_pa], y_pp)
    x = [beta_x * (h - state.h[w]) / dx - along, beta_x * (state.h[e] - h) / dx - along]
    y = [beta_y * (h - state.h[s]) / dy, beta_y * (state.h[n] - h) / dy]
    steep_x, steep_y = np.maximum(*np.abs(x)), np.maximum(*np.abs(y))
    drive = np.maximum(np.hypot(steep_x, sum(y) / 2), np.hypot(sum(x) / 2, steep_y))
    held = (drive <= normal * tangent * YIELD_TOLERANCE) & (u == 0) & (v == 0)
    static = np.where(wet, np.where(held, 2.0, 0.0), 1.0)
    rate = (np.abs(u) + np.sqrt(beta_x * h)) / dx + (np.abs(v) + np.sqrt(beta_y * h)) / dy
    return beta_x, beta_y, static, np.where(wet, rate, 0.0)


@dataclass
class Run:
    """A scene stepped by the dense scheme; the state has no ghosts between steps."""

    scene: object
    arrival_depth: float = 0.0
    time: float = 0.0
    steps: int = 0
    inflow: float = 0.0
    outflow: float = 0.0
    rest_time: float = np.nan
    drained: int = 0

    def __post_init__(self):
        scene, lattice, sides = self.scene, self.scene.points, self.scene.boundaries
        self.sides = sides.x_min, sides.x_max, sides.y_min, sides.y_max
        given = [side for side in self.sides if not isinstance(side, str)]
        self.dry = scene.scheme.wet_limit * max(scene.depth.max(), *given, 0)
        wet = scene.depth > self.dry
        velocity = scene.velocity_x, scene.velocity_y
        self.state = State(scene.depth.copy(), *(np.where(wet, q, 0.0) for q in velocity))
        self.dx, self.dy = lattice.dx, lattice.dy
        x = np.pad(lattice.x_points, 2, mode="edge")
        xi = scene.terrain.inclination(x)
        self.along, self.normal = scene.gravity * np.sin(xi), scene.gravity * np.cos(xi)
        self.curvature = scene.terrain.curvature(x)
        self.tangent = np.tan(np.radians(scene.friction.bed_friction))
        turbulent = isinstance(scene.friction, Voellmy)
        self.drag = scene.gravity / scene.friction.turbulent_friction if turbulent else 0.0
        beyond = np.abs(self.along) - self.tangent * self.normal
        self.lean = np.sign(self.along) * np.maximum(0, beyond)
        padding = np.ones((lattice.shape[0] + 4, 1))
        coefficients = scene.earth_pressure.coefficients()
        self.beta_x = padding * self.normal * coefficients.x_active
        self.beta_y = padding * self.normal * coefficients.y_active_active
        free = np.maximum(0, beyond) / self.dx
        self.falling = np.sqrt(scene.scheme.cfl * free)[2:-2]
        self.rest_volume = scene.scheme.rest_share * self.volume
        shape = lattice.shape
        self.max_depth, self.max_speed, self.max_flux = np.zeros((3, *shape))
        self.arrival = np.full(shape, np.nan)
        self.record()

    @property
    def volume(self):
        return self.state.h.sum() * self.dx * self.dy

    def record(self):
        h, u, v = self.state
        square = u**2 + v**2
        self.max_depth = np.maximum(self.max_depth, h)
        self.max_speed = np.maximum(self.max_speed, np.sqrt(square))
        self.max_flux = np.maximum(self.max_flux, h * square)
        self.arrival[np.isnan(self.arrival) & (h > self.arrival_depth)] = self.time

    def surrounded(self, state):
        """Pad a state by its ghosts."""
        west, east = self.beta_x[2:-2, 2], self.beta_x[2:-2, -3]
        rises = -self.lean[0] / west * self.dx, self.lean[-1] / east * self.dx
        return padded(state, self.sides, rises, (west, east, self.beta_y[2], self.beta_y[-3]))

    def classify(self):
        """Set padded beta_x, beta_y and static; return the largest wave rate and the volume that moves."""
        all_ = self.surrounded(self.state)
        material = (self.scene.earth_pressure.coefficients(), self.tangent, self.dry)
        *status, rates = classify(all_, self.along, self.normal, *material, self.dx, self.dy)
        rates = rates[1:-1, 1:-1]
        status = [np.pad(q[1:-1, 1:-1], 2, mode="edge") for q in status]
        # the first step from rest is as long as gravity lets it be
        rate = np.where(rates > 0, np.maximum(rates, self.falling), 0).max()
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

    def stage(self, source, part, share, dt):
        """U_0 + part (U_1 - U_0 + dt L(U_1)), then friction over part dt."""
        h_0, u_0, v_0 = self.state
        h_1, u_1, v_1 = source
        all_ = self.surrounded(source)
        x = fluxes(all_, self.beta_x, self.static, *self.sides[:2], self.dry)
        y = fluxes(transposed(all_), self.beta_y.T, self.static.T, *self.sides[2:], self.dry)
        keep = outflow_limits(h_1, x.mass, y.mass.T, dt, self.dx, self.dy)
        self.drained += int((keep < 1).sum())
        x, y = scaled(x, keep), scaled(y, keep.T)
        for mass, length in ((x.mass, self.dy), (y.mass, self.dx)):
            leaving = np.concatenate([-mass[:, 0], mass[:, -1]])
            self.outflow += share * dt * length * np.maximum(leaving, 0).sum()
            self.inflow -= share * dt * length * np.minimum(leaving, 0).sum()
        y = Flux(*(q.T for q in y))
        free = self.static[INNER] != 2
        left = h_1 + dt * (difference(x.mass) / self.dx + difference(y.mass.T).T / self.dy)
        load = loaded(h_1, left)
        beta_x, beta_y = self.beta_x[INNER], self.beta_y[INNER]
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
        start, source = (h_0, h_0 * u_0, h_0 * v_0), (h_1, h_1 * u_1, h_1 * v_1)
        h, hu, hv = (
            q_0 + part * (q_1 - q_0 + dt * gain) for q_0, q_1, gain in zip(start, source, gains, strict=True)
        )
        wet = h > self.dry
        u, v = (np.where(wet, q / np.where(wet, h, 1.0), 0.0) for q in (hu, hv))
        bed = self.normal[2:-2], self.curvature[2:-2]
        return State(h, *brake(load, u_1, h, u, v, bed, self.tangent, self.drag, self.dry, part * dt))

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


def simulate(scene, times, arrival_depth=0.0):
    """A finished run, and its frames: depth and velocities of shape (nt, ny, nx)."""
    run = Run(scene, arrival_depth)
    frames = []
    for time in times:
        if np.isnan(run.rest_time):
            run.advance(time)
        frames.append(run.state)
    return run, State(*(np.stack(q) for q in zip(*frames, strict=True)))
