"""The collocation form in plain NumPy, with full matrices over points and images: one step at a time."""

import numpy as np
from dense import Twin
from dense_pressure import earth_pressure

from solver.collocation.run import AROUND, images_of
from solver.kernels.runge_kutta import SSP_RK3
from solver.run import sides_of


def spread_out(neighbours, weights, columns):
    """Matrix (n, columns) of weights by neighbour; a neighbour met twice counts twice."""
    matrix = np.zeros((len(neighbours), columns))
    np.add.at(matrix, (np.arange(len(neighbours))[:, None], neighbours), weights)
    return matrix


class DenseCollocation(Twin):
    """A scene stepped by full matrices; no dry region is left out."""

    films = False

    def __init__(self, scene, operators):
        self.scheme = scene.scheme
        stencils = operators.stencils
        self.n, columns = operators.count, len(operators.area)
        self.images, self.area = images_of(operators, sides_of(scene)), operators.area[: self.n]
        near = stencils.neighbours.astype(int)
        x, y = (np.broadcast_to(stencils.gradient[..., k], near.shape) for k in (0, 1))
        self.d_x, self.d_y = (spread_out(near, w, columns) for w in (x, y))
        self.value = spread_out(near, np.broadcast_to(stencils.value, near.shape), columns)
        self.around = spread_out(near[:, :AROUND], np.ones_like(x[:, :AROUND]), columns)
        self.exchange = self.mean_exchange(operators)
        self.places = operators.coordinates
        super().__init__(scene, 0.0, *(a.ravel() for a in scene.points.coordinates))
        deepest = scene.depth.max()
        self.film, self.floor = self.scheme.film * deepest, self.scheme.floor * deepest
        self.state = [a.ravel().copy() for a in (scene.depth, scene.velocity_x, scene.velocity_y)]

    def mean_exchange(self, operators):
        """(V_i S_ij + V_j S_ji) / (2 V_i), where the image of j is to i what that of i is to j."""
        owner, n = self.images.owner, self.n
        # in a narrow domain a point has several images of one kind: told apart by what moves it there
        mirror = np.where(np.concatenate([np.zeros((n, 2)), operators.beyond]) == 0, 1, -1)
        moved = np.round(operators.coordinates - operators.coordinates[owner] * mirror, 6)
        _, kind = np.unique(np.c_[mirror, moved], axis=0, return_inverse=True)
        self.kinds = [np.flatnonzero(kind == k) for k in np.unique(kind)]
        asked = self.area[:, None] * self.value
        wanted = 0.5 * (asked + self.seen_from_there(asked))
        wanted[np.arange(n), np.arange(n)] = 0
        return wanted / self.area[:, None]

    def seen_from_there(self, pairs):
        """Of each pair of i and an image of j, what holds for j and the same image of i; (n, columns)."""
        there = np.zeros_like(pairs)
        for members in self.kinds:
            points = self.images.owner[members]
            square = np.zeros((self.n, self.n), pairs.dtype)
            square[:, points] = pairs[:, members]
            there[:, members] = square.T[:, points]
        return there

    def filled(self, h, a, b):
        """Points and images of depth and of velocity or momentum."""
        owner, out, sign = self.images.owner, self.images.outward, self.images.sign
        n = self.n
        parts = [h[owner]]
        for k, q in enumerate((a, b)):
            image = q[owner[n:]]
            parts.append(np.concatenate([q, sign[:, k] * np.where(out[:, k], np.abs(image), image)]))
        return parts

    def pressure(self):
        """beta along and across and the waves of the state, by the velocity gradient among wet points."""
        h, u, v = self.filled(*self.state)
        wet = h > self.dry
        u_x, v_y = (
            d @ (wet * q) - q[: self.n] * (d @ wet.astype(float)) for d, q in ((self.d_x, u), (self.d_y, v))
        )
        here = wet[: self.n]
        fall = np.where(here, np.sqrt(np.maximum(h[: self.n], 0) / self.normal), 0)
        rises = np.abs(self.d_x @ h), np.abs(self.d_y @ h)
        law = self.scene.earth_pressure
        return earth_pressure(law, here * u_x, here * v_y, fall, self.normal, rises)

    def relaxed(self, h, hu, hv):
        """Eqs. 24 and 25, as an exchange between pairs or as printed."""
        scheme, owner, n = self.scheme, self.images.owner, self.n
        full = self.filled(h, hu, hv)
        value = self.value @ full[0]
        flag = np.abs(h - value) > scheme.threshold * np.maximum(np.abs(value), self.floor)
        if scheme.smoothing == "pairs":
            steepens = self.steepens(*full)
            # a pair is met at the flagged point of lower number
            mine = flag[:, None] & (~flag[owner] | (np.arange(n)[:, None] <= owner))
            steepens = np.where(mine, steepens, self.seen_from_there(steepens))
            use = (flag[:, None] | flag[owner]) & ~((self.exchange < 0) & steepens)
            weights = scheme.relaxation * np.where(use, self.exchange, 0.0)
            changes = [weights @ q - weights.sum(axis=1) * q[:n] for q in full]
        else:
            changes = [scheme.relaxation * flag * (self.value @ q - q[:n]) for q in full]
        if scheme.smoothed == "depth":
            changes[1:] = 0, 0
        h, hu, hv = (q[:n] + change for q, change in zip(full, changes, strict=True))
        return np.maximum(h, 0) if scheme.clip else h, hu, hv

    def steepens(self, h, hu, hv):
        """Whether one of a pair is dry, or both close in a shock; (n, columns)."""
        n, owner = self.n, self.images.owner
        wet = h > self.dry
        depth = np.where(wet, h, 1.0)
        offset = self.places[None] - self.places[:n, None]
        u, v = hu / depth, hv / depth
        closing = (u[None] - u[:n, None]) * offset[..., 0] + (v[None] - v[:n, None]) * offset[..., 1]
        weight = self.normal[owner] * h
        waves = (weight[None] + weight[:n, None]) / 2 * (offset**2).sum(axis=-1)
        return ~(wet[None] & wet[:n, None]) | ((closing < 0) & (closing**2 > waves))

    def velocities(self, h, hu, hv):
        """Of films the mean of what is around."""
        full = self.filled(h, hu, hv)
        wet, film = h > self.dry, (h > self.dry) & (h < self.film)
        flows = full[0] > self.dry
        h_mean, hu_mean, hv_mean = (self.around @ (flows * q) for q in full)
        depth = np.where(film, h_mean, np.where(wet, h, 1.0))
        return (
            h,
            *(
                np.where(wet, np.where(film, mean, q) / depth, 0.0)
                for mean, q in ((hu_mean, hu), (hv_mean, hv))
            ),
        )

    def step(self, dt):
        """One step of eq. 14."""
        source = self.state
        beta_x, beta_y, *_ = self.pressure()
        for part in SSP_RK3:
            h, u, v = self.filled(*source)
            mass, along, across = (
                self.d_x @ (h * u * q) + self.d_y @ (h * v * q) for q in (np.ones_like(h), u, v)
            )
            depth = np.maximum(source[0], 0)
            gain_u = depth * (self.along - beta_x * (self.d_x @ h)) - along
            gain_v = -depth * beta_y * (self.d_y @ h) - across
            bed = self.normal, self.curvature
            h, u, v = self.updated(source, (-mass, gain_u, gain_v), depth, bed, part, dt)
            source = self.velocities(*self.relaxed(h, h * u, h * v))
        self.state = source
