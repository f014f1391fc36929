"""Algorithm 1 as the paper prints it: plain, slow, with scikit-learn's LARS. What ours is compared with."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from sklearn.decomposition import sparse_encode

from sparsor.core.streams import stream


def algorithm_1(psi, validation, shape, *, M, p, theta, n_iter, lambdas, lasso, seed, paper):
    """The paper's pseudocode line by line; returns Phi*, path*, cost and sample."""
    lambda_valid, lambda_path, lambda_incoh = lambdas
    N = psi.shape[0]
    C_min = np.inf
    best = None
    for r in range(n_iter):
        phi = (stream(seed, r).random((M, N)) < p).astype(float)
        for i in range(N):  # Eq. 11
            if phi[:, i].sum() < theta:
                phi[:, i] = 0
        image = phi.sum(axis=0) > 0
        if image.sum() < 2:
            continue
        mu = incoherence(phi, psi, unit_rows=not paper)
        path, length = shortest_path_over_ones(image, shape, improve=not paper)
        error = 0.0
        for s in validation:
            s_m = phi @ s
            c = sparse_encode(s_m[None], (phi @ psi).T, algorithm="lasso_lars", alpha=lasso)[0]
            s_hat = psi @ c
            error += np.sum((s - s_hat) ** 2)
        error /= len(validation)
        C = lambda_valid * error + lambda_path * length + lambda_incoh * mu
        if C_min > C:
            C_min, best = C, (phi.astype(bool), path, r)
    return *best, C_min


def incoherence(phi, psi, *, unit_rows):
    mu = 0.0
    for row in phi:
        norm = np.linalg.norm(row) if unit_rows else 1.0
        if row.any():
            mu = max(mu, np.abs(row / norm @ psi).max())
    return mu


def shortest_path_over_ones(image, shape, *, improve):
    cells = np.flatnonzero(image)
    place = np.stack(np.divmod(cells, shape[1]), axis=1).astype(float)
    order = [0]
    while len(order) < len(cells):
        left = [k for k in range(len(cells)) if k not in order]
        order.append(min(left, key=lambda k: (np.hypot(*(place[k] - place[order[-1]])), k)))
    if improve:
        order = two_opt_or_opt(order, place)
    path = cells[order]
    return path, path_length(order, place)


def path_length(order, place):
    return float(sum(np.hypot(*(place[a] - place[b])) for a, b in pairwise(order)))


def two_opt_or_opt(order, place):
    """The moves of design.route, each judged by the length of the whole path."""
    least = 1e-9 * path_length(order, place)
    while True:
        order, reversed_any = _reverse(order, place, least)
        if reversed_any:
            continue
        order, moved_any = _move(order, place, least)
        if not moved_any:
            return order


def _reverse(order, place, least):
    improved = False
    for i in range(len(order) - 1):
        for j in range(i + 1, len(order)):
            turned = order[:i] + order[i : j + 1][::-1] + order[j + 1 :]
            if path_length(order, place) - path_length(turned, place) > least:
                order, improved = turned, True
    return order, improved


def _move(order, place, least):
    improved = False
    for size in range(1, min(3, len(order) - 1) + 1):
        for i in range(len(order) - size + 1):
            segment, rest = order[i : i + size], order[:i] + order[i + size :]
            now = path_length(order, place)
            best, found = least, None
            for k in range(len(rest) + 1):
                for piece in (segment, segment[::-1]):
                    moved = rest[:k] + piece + rest[k:]
                    gain = now - path_length(moved, place)
                    if gain > best + 1e-12:  # equal gains: the first place, as ours
                        best, found = gain, moved
            if found is not None:
                order, improved = found, True
    return order, improved
