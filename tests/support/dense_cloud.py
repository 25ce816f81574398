"""The weighted-residual scheme on clouds on whole arrays, written from its equations; nothing is skipped.

Faces are the inner ones, then the boundary ones, whose right cell is a ghost of their own.
"""

import numpy as np
from dense import (
    EMPTIED,
    YIELD_TOLERANCE,
    Flux,
    State,
    Twin,
    afforded,
    along_at_depth,
    at_rear,
    bounded_film,
    face_state,
    hll,
    in_stage,
    leaving_at_depth,
    limited,
    loaded,
    raised_by_fall,
    steepness_of,
)
from dense_pressure import earth_pressure, stretching

from solver.lmls.shape_functions import approximation
from solver.points.voronoi import SIDE_NORMALS


def toward(gap, ahead, part, steepness):
    """Limited step to a part of the way to a neighbour, from the gradient's and the true difference to it."""
    return limited(part * np.abs(gap + (ahead - gap) / 3), 2 * gap - ahead, ahead, steepness)


class CloudRun(Twin):
    """A scene stepped by the dense scheme."""

    def __init__(self, scene, arrival_depth=0.0):
        cells, scheme = scene.points.control_volumes, scene.scheme
        self.cells, self.n, self.limited, b = cells, len(cells.area), 0, len(cells.side)
        slope = approximation(
            cells.centroid,
            cells.centroid,
            scene.points.nearest(scheme.support),
            scheme.degree,
            scheme.weight_shape,
            second_moment=cells.second_moment,
        )
        self.neighbours, self.weights = slope.neighbours, (slope.along, slope.across)
        # by the others alone: shape functions have no first moment, so that linear fields keep their slope
        others = slope.value[:, 1:] / slope.value[:, 1:].sum(axis=1, keepdims=True)
        self.by_others = [np.pad(w[:, 1:] + w[:, :1] * others, ((0, 0), (1, 0))) for w in self.weights]
        self.to_neighbours = cells.centroid[slope.neighbours] - cells.centroid[:, None]
        # faces
        outward = SIDE_NORMALS[cells.side]
        self.left = np.concatenate([cells.left, cells.side_cell])
        self.right = np.concatenate([cells.right, self.n + np.arange(b)])
        self.inner = len(cells.left)
        self.length = np.concatenate([cells.length, cells.side_length])
        self.face_normal = np.concatenate([cells.normal, outward])
        middle = np.concatenate([cells.midpoint, cells.side_midpoint])
        depth = ((cells.side_midpoint - cells.centroid[cells.side_cell]) * outward).sum(axis=1)
        mirrored = cells.centroid[cells.side_cell] + 2 * depth[:, None] * outward
        place = np.concatenate([cells.centroid, mirrored])
        self.way = place[self.right] - place[self.left]
        self.rest_of_way, self.part = [], []
        for end, sign in ((self.left, 1), (self.right, -1)):
            to = middle - place[end]
            part = (to * sign * self.way).sum(axis=1) / (self.way**2).sum(axis=1)
            self.part.append(np.clip(part, 0, 1))
            self.rest_of_way.append(to - sign * part[:, None] * self.way)
        self.widths = self.measure()
        super().__init__(scene, arrival_depth, *cells.centroid.T, self.widths[0])
        self.kinds = [self.sides[side] for side in cells.side]
        self.rise = self.way[self.inner :, 0] * np.concatenate([self.excess, [0, 0]])[cells.side]
        self.beta = tuple(self.normal * k for k in self.at_rest)
        self.released = self.state.h @ cells.area

    def around(self, values):
        """Sum over the faces of each cell of values (f,), of faces or of both their sides."""
        one, two = values if isinstance(values, tuple) else (values, values)
        return np.bincount(self.left, one, self.n) + np.bincount(
            self.right[: self.inner], two[: self.inner], self.n
        )

    def measure(self):
        """Half sums of |l_x|, |l_y| and l per area, and the means of n_x^2 and n_x n_y around each cell."""
        n_x, n_y = self.face_normal.T
        around = self.around(self.length)
        shape = [self.around(self.length * q) / around for q in (n_x**2, n_x * n_y)]
        widths = []
        for q in (np.abs(n_x), np.abs(n_y), 1.0):
            own = self.around(self.length * q) / self.cells.area / 2
            beyond = self.around((own[self.right * (self.right < self.n)], own[self.left]))
            for i, f in zip(self.cells.side_cell, range(self.inner, len(self.left)), strict=True):
                beyond[i] -= own[self.right[f] * (self.right[f] < self.n)]
            count = 1 + self.around(np.arange(len(self.left)) < self.inner)
            widths.append(np.maximum(own / 1.25, (own + beyond) / count))
        return (*widths, *shape)

    def with_ghosts(self, state):
        """Cells, then ghosts."""
        h, u, v = (q[self.cells.side_cell] for q in state)
        for b, (kind, side) in enumerate(zip(self.kinds, self.cells.side, strict=True)):
            if kind in ("wall", "no-slip"):
                rise = self.rise[b] / self.beta[0][self.cells.side_cell[b]]
                h[b] = max(0.0, h[b] + rise)
            if not isinstance(kind, str):
                q, t, beta = (u, v, self.beta[0]) if side < 2 else (v, u, self.beta[1])
                sign, i, k = 2 * (side % 2) - 1, self.cells.side_cell[b], 2 - side // 2 * 2
                q[b] = sign * leaving_at_depth(sign * q[b], h[b], kind, beta[i], self.fastest[side])
                t[b] = along_at_depth(t[b], kind, beta[i], *self.fastest[k : k + 2])
                h[b] = kind
            if kind == "no-slip" or (kind == "wall" and side < 2):
                u[b] = -u[b]
            if kind == "no-slip" or (kind == "wall" and side >= 2):
                v[b] = -v[b]
        return State(*(np.concatenate(q) for q in zip(state, (h, u, v), strict=True)))

    def slopes(self, q, counts=True):
        """LMLS derivatives (n, 2) from differences to neighbours, of those alone that count."""
        difference = (q[self.neighbours] - q[:, None]) * counts
        return np.stack([(w * difference).sum(axis=1) for w in self.weights], axis=1)

    def slopes_of_velocity(self, q, h):
        """The same by wet neighbours; none beside a side of given depth."""
        found = self.slopes(q, h[self.neighbours] > self.dry)
        fed = [not isinstance(kind, str) for kind in self.kinds]
        found[self.cells.side_cell[fed]] = 0
        return found

    def most_slower(self, h, u, v):
        """What a cell may be slower at a face, times its speed: by the fastest around it, or its lead."""
        seen = self.neighbours[:, 1:]
        more = np.stack([q[seen] - q[:, None] for q in (u, v)])
        along = np.where(h[seen] > self.dry, more[0] * u[:, None] + more[1] * v[:, None], -np.inf).max(axis=1)
        square = u**2 + v**2
        sent = (4 * self.normal * h + 0.01**2 * square) * square
        most, lead = np.sqrt(sent), np.maximum(-along, 0.0)
        leading = np.where(lead > most, sent / np.where(lead > most, lead, 1.0), most)
        return np.where(along > 0, most + 2 * np.maximum(along, 0), leading)

    def stretched(self, q, h, k):
        """Rate of stretching along axis k by the others of a support; none beside a given depth."""
        difference = (q[self.neighbours] - q[:, None]) * (h[self.neighbours] > self.dry)
        linear = np.stack([(w * difference).sum(axis=1) for w in self.by_others], axis=1)
        # the derivative ahead and that behind, each of what is left of the linear part
        left = difference - (linear[:, None] * self.to_neighbours).sum(axis=2)
        ahead = np.sign(self.to_neighbours[..., k]) * self.by_others[k]
        own = ahead.sum(axis=1) > 1e-9 * np.abs(ahead).sum(axis=1)
        found = stretching(linear[:, k], np.where(own, (ahead * left).sum(axis=1), 0), self.slopes(h)[:, k])
        found[self.cells.side_cell[[not isinstance(kind, str) for kind in self.kinds]]] = 0
        return found

    def classify(self):
        """Set beta and static of cells and ghosts; return the largest wave rate and the volume that moves."""
        all_ = self.with_ghosts(self.state)
        square = np.where(all_.h > self.dry, all_.u**2 + all_.v**2, 0.0)
        most = np.zeros(self.n)
        for here, there in ((self.left, self.right), (self.right[: self.inner], self.left[: self.inner])):
            np.maximum.at(most, here, square[there])
        self.state = bounded_film(self.state, self.dry, most)
        h, u, v = self.state
        all_, wet = self.with_ghosts(self.state), h > self.dry
        may_flow = wet | (u != 0) | (v != 0)
        w_x, w_y, w, m_x, m_xy = self.widths
        tie = 1e-10 * w * (np.abs(u) + np.abs(v) + np.sqrt(self.normal * h))
        rates = [self.stretched(q, h, k) for k, q in enumerate((u, v))]
        rates = [np.where(np.abs(rate) > tie, rate, 0) for rate in rates]
        fall = np.where(wet, np.sqrt(h / self.normal), 0)
        law, rises = self.scene.earth_pressure, np.abs(self.slopes(h).T)
        b_x, b_y, *pushes = earth_pressure(law, *rates, fall, self.normal, rises)
        square = np.maximum(0, m_x * u**2 + (1 - m_x) * v**2 + 2 * m_xy * u * v)
        leaving = np.minimum(w * np.sqrt(square), w_x * np.abs(u) + w_y * np.abs(v))
        push = w_x * pushes[0] + w_y * pushes[1]
        waves = push + np.sqrt(push**2 + w**2 * (m_x * b_x + (1 - m_x) * b_y) * h)
        rate = np.where(may_flow, raised_by_fall(leaving + waves, leaving, self.falling), 0.0).max()
        # held where the drive at no face but a wall's exceeds friction
        gradient, exceeds = self.slopes(h), np.zeros(self.n, dtype=int)
        walled = np.zeros(len(self.left), dtype=bool)
        walled[self.inner :] = [k in ("wall", "no-slip") for k in self.kinds]
        for here, there, sign in ((self.left, self.right, 1), (self.right, self.left, -1)):
            f = np.flatnonzero((here < self.n) & ~walled)
            i, way = here[f], sign * self.way[f]
            rise = all_.h[there[f]] - h[i]
            more = (rise - (gradient[i] * way).sum(axis=1)) / (way**2).sum(axis=1)
            slope = gradient[i] + more[:, None] * way
            pull = np.stack([b_x[i] * slope[:, 0] - self.along[i], b_y[i] * slope[:, 1]], axis=1)
            slides_in = (all_.h[there[f]] <= self.dry) & ((pull * way).sum(axis=1) >= 0)
            limit = self.normal[i] * self.tangent * YIELD_TOLERANCE
            np.add.at(exceeds, i, ~slides_in & (np.hypot(*pull.T) > limit))
        held = wet & (u == 0) & (v == 0) & (exceeds == 0)
        cell = self.cells.side_cell
        static = np.concatenate([(~may_flow | held), (~may_flow | held)[cell]])
        self.beta = tuple(np.concatenate([q, q[cell]]) for q in (b_x, b_y))
        driven = False
        for b, kind in enumerate(self.kinds):
            f, i = self.inner + b, cell[b]
            if isinstance(kind, str) or kind <= self.dry:
                continue
            n_x, n_y = self.face_normal[f]
            b_n = b_x[i] * n_x**2 + b_y[i] * n_y**2
            push = np.abs(b_n * (kind - h[i]) / np.hypot(*self.way[f]) - n_x * self.along[i])
            if push > self.normal[i] * self.tangent * YIELD_TOLERANCE:
                static[self.n + b], driven = False, True
                rate = max(rate, 2 * np.sqrt(b_n * kind) * self.length[f] / self.cells.area[i])
            driven |= not static[self.n + b]
        given = [not isinstance(kind, str) and kind > self.dry for kind in self.kinds]
        self.static, self.held = static, np.concatenate([held, (held[cell] | given) & static[self.n :]])
        moving = (h * self.cells.area)[~static[: self.n]].sum()
        return rate, np.inf if driven else moving

    def face_states(self, state, side):
        """Depth, normal and tangential velocity at the midpoints of faces, on one side."""
        here, beyond = (self.left, self.right) if side == 0 else (self.right, self.left)
        sign, part, off = 1 - 2 * side, self.part[side], self.rest_of_way[side]
        way, n = sign * self.way, self.face_normal
        h, u, v = (q[: self.n] for q in state)
        most = np.concatenate([self.most_slower(h, u, v), np.zeros(len(state.h) - self.n)])[here]
        found = self.slopes(h), *(self.slopes_of_velocity(q, h) for q in (u, v))
        none = np.zeros((len(state.h) - self.n, 2))
        slopes = [np.concatenate([q, none])[here] for q in found]
        gaps, offs = ([(g * d).sum(axis=1) for g in slopes] for d in (way, off))

        def turned(u, v):
            return n[:, 0] * u + n[:, 1] * v, n[:, 0] * v - n[:, 1] * u

        h_gap, (n_gap, t_gap) = gaps[0], turned(*gaps[1:])
        h_off, (n_off, t_off) = offs[0], turned(*offs[1:])
        h_0, h_1 = state.h[here], state.h[beyond]
        (n_0, t_0), (n_1, t_1) = (turned(state.u[k], state.v[k]) for k in (here, beyond))
        h_behind = h_1 - 2 * h_gap
        ahead, t_ahead = np.where(h_1 > self.dry, (n_1, t_1), (n_0, t_0))
        n_behind = ahead - 2 * n_gap
        beta = sum(b[here] * q**2 for b, q in zip(self.beta, n.T, strict=True))
        steepness = steepness_of(sign * np.where(h_behind > self.dry, n_behind, n_0), sign * ahead)
        n_step = toward(n_gap, ahead - n_0, part, steepness) + n_off
        t_step = toward(t_gap, t_ahead - t_0, part, 2.0) + t_off
        slower = -(n_0 * n_step + t_0 * t_step)
        kept = np.where(slower > most, (most + 1e-300) / np.where(slower > most, slower + 1e-300, 1), 1.0)
        h_face = np.minimum(h_0 + toward(h_gap, h_1 - h_0, part, steepness) + h_off, 2 * h_0)
        rear = at_rear(h_0, h_behind, h_1, sign * n_0, steepness)
        h_face = np.where(rear, h_0 + np.minimum(part * (h_1 - h_0), 3 * h_0), h_face)
        at_face = h_face, kept * n_step, kept * t_step
        behind = h_behind, n_behind, beta * h_behind
        depth, normal, tangential = face_state((h_0, n_0, t_0), at_face, h_1, behind, sign, self.dry)
        # what moves away from a film shows it no velocity beyond what its waves have there
        sent = np.maximum(0, sign * n_0 + 2 * np.sqrt(np.maximum(0, beta * h_0)))
        away = (sign * n_0 < 0) & (sign * normal > sent) & (h_1 < 0.1 * h_0)
        return depth, np.where(away, sign * sent, normal), tangential

    def stage(self, source, part, share, dt):
        """U_0 + part (U_1 - U_0 + dt L(U_1)), then friction over part dt."""
        h_1, u_1, v_1 = source
        all_, area = self.with_ghosts(source), self.cells.area
        n_x, n_y = self.face_normal.T
        beta = self.beta
        c = [
            np.sqrt((beta[0][k] * n_x**2 + beta[1][k] * n_y**2) * all_.h[k]) for k in (self.left, self.right)
        ]
        low, high = (list(self.face_states(all_, side)) for side in (0, 1))
        for b, kind in enumerate(self.kinds):
            f = self.inner + b
            if kind in ("wall", "no-slip"):
                tangential = low[2][f] if kind == "wall" else -low[2][f]
                high[0][f], high[1][f], high[2][f], c[1][f] = low[0][f], -low[1][f], tangential, c[0][f]
        static = [self.static[k].astype(float) + self.held[k] for k in (self.left, self.right)]
        flux = hll(*low, *high, *c, *static, self.dry)
        mass, normal, tangential, pressure = (np.array(q) for q in flux)
        for b, kind in enumerate(self.kinds):
            f, i = self.inner + b, self.cells.side_cell[b]
            if kind == "open" and mass[f] < 0:
                mass[f] = normal[f] = tangential[f] = 0
            if kind in ("wall", "no-slip"):
                mass[f] = tangential[f] = 0
                thin = self.cells.side[b] < 2 and self.rise[b] / beta[0][i] > h_1[i]
                most = h_1[i] * max(0.0, n_x[f] * u_1[i]) * area[i] / (self.length[f] * dt)
                normal[f] = min(normal[f], most) if thin else normal[f]
            if kind == "no-slip":
                n, t = n_x[f] * u_1[i] + n_y[f] * v_1[i], n_x[f] * v_1[i] - n_y[f] * u_1[i]
                tangential[f] = (np.abs(n) + c[0][f]) * h_1[i] * t
        lost = dt * self.around((self.length * np.maximum(mass, 0), self.length * np.maximum(-mass, 0)))
        has = in_stage(self.state, source, part)
        lost = lost / np.where(has.h > 0, has.h * area, 1.0)
        self.limited += int((lost > EMPTIED).sum())
        outside = np.zeros(len(self.kinds))

        def giver(q):
            all_ = np.concatenate([q, outside])
            return np.where(mass > 0, all_[self.left], np.where(mass < 0, all_[self.right], 0.0))

        momentum = n_x * normal - n_y * tangential, n_y * normal + n_x * tangential
        mass, *momentum, _ = afforded(
            Flux(mass, *momentum, pressure), giver(lost), giver(has.u), giver(has.v)
        )
        through = share * dt * (self.length * mass)[self.inner :]
        np.add.at(self.ledger[:, 1], self.cells.side, np.maximum(through, 0))
        np.add.at(self.ledger[:, 0], self.cells.side, np.maximum(-through, 0))
        free = 1 - self.held[: self.n]
        load = loaded(h_1, has.h + dt * self.around((-self.length * mass, self.length * mass)) / area)
        acting = np.where(load < h_1, load / np.where(h_1 > 0, h_1, 1.0), 1.0)
        gains = [self.around((-self.length * mass, self.length * mass)) / area]
        for q, n, b, pull in zip(momentum, (n_x, n_y), beta, (self.along, 0.0), strict=True):
            push = self.around((-self.length * n * pressure, self.length * n * pressure))
            carried = self.around((-self.length * q, self.length * q))
            gains.append(carried / area + free * (acting * b[: self.n] * push / area + pull * load))
        return self.updated(source, gains, load, (self.normal, self.curvature), part, dt)


def simulate(scene, end, arrival_depth=0.0):
    """A finished run."""
    run = CloudRun(scene, arrival_depth)
    run.advance(end)
    return run
