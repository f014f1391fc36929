"""Kalman filter and smoother of a slow sensor carried through air that varies along the way, compiled.

State: what the sensor shows, what the air is, and the air's slope along the way, all less the level. The sensor
answers in first order; the air is a Matern-3/2 process of the distance flown, so that it rests while the vehicle
dwells. Where the vehicle turns, the slope turns into one of another, equally uncertain direction. Between samples
the air is taken as linear in time (first-order hold). The smoother is the fixed-interval one of Bryson and Frazier in
the form of Durbin and Koopman (2012, section 4.4), which inverts nothing and so takes steps of no length.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.compiled import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray

_UNKNOWN = 100.0  # variance of what the sensor holds at a start, in variances of the readings


@njit(cache=True, nogil=True)
def response_shares(duration_s: float, tau_s: float) -> tuple[float, float, float]:
    """Return what a sensor shows after a step: shares of what it showed, of the air before, of the air now."""
    if tau_s == 0:
        return 0.0, 0.0, 1.0
    if duration_s <= 0:  # several values of one time
        return 1.0, 0.0, 0.0
    ratio = duration_s / tau_s
    held = math.exp(-ratio)
    ramp = -math.expm1(-ratio) / ratio
    return held, ramp - held, 1.0 - ramp


@njit(cache=True, nogil=True)
def predict(
    P: NDArray[np.float64],
    Phi: NDArray[np.float64],
    duration_s: float,
    step_m: float,
    turn: float,
    tau_s: float,
    spread: float,
    rate: float,
) -> None:
    """Carry the covariance `P` over a step, and fill `Phi` with the transition."""
    held, before, after = response_shares(duration_s, tau_s)
    x = rate * step_m
    decay = math.exp(-x)
    f11, f12 = decay * (1.0 + x), decay * step_m
    f21, f22 = -decay * rate * x, decay * (1.0 - x)
    sd2, slope2 = spread * spread, (spread * rate) ** 2
    # What the process adds over the step keeps its stationary variance; the turn does so for the slope.
    q11 = max(sd2 - f11 * f11 * sd2 - f12 * f12 * slope2, 0.0)
    q12 = -(f11 * f21 * sd2 + f12 * f22 * slope2)
    q22 = max(slope2 - f21 * f21 * sd2 - f22 * f22 * slope2, 0.0)
    lateral = (1.0 - turn * turn) * slope2
    Phi[0, 0], Phi[0, 1], Phi[0, 2] = held, before + after * f11, after * f12 * turn
    Phi[1, 0], Phi[1, 1], Phi[1, 2] = 0.0, f11, f12 * turn
    Phi[2, 0], Phi[2, 1], Phi[2, 2] = 0.0, f21, f22 * turn
    P[:, :] = Phi @ P @ Phi.T
    q11 += f12 * f12 * lateral
    q12 += f12 * f22 * lateral
    q22 += f22 * f22 * lateral
    P[0, 0] += after * after * q11
    P[0, 1] += after * q11
    P[1, 0] += after * q11
    P[0, 2] += after * q12
    P[2, 0] += after * q12
    P[1, 1] += q11
    P[1, 2] += q12
    P[2, 1] += q12
    P[2, 2] += q22


@njit(cache=True, nogil=True)
def begin(P: NDArray[np.float64], tau_s: float, spread: float, rate: float, noise: float) -> None:
    """Fill `P` with what is known before the first sample."""
    P[:, :] = 0.0
    P[1, 1] = spread * spread
    P[2, 2] = (spread * rate) ** 2
    if tau_s == 0:
        P[0, 0] = P[0, 1] = P[1, 0] = P[1, 1]
    else:
        P[0, 0] = _UNKNOWN * (spread * spread + noise * noise)


@njit(cache=True, nogil=True)
def likelihood(
    value: NDArray[np.float64],
    usable: NDArray[np.bool_],
    duration_s: NDArray[np.float64],
    step_m: NDArray[np.float64],
    turn: NDArray[np.float64],
    start: NDArray[np.bool_],
    tau_s: float,
    spread: float,
    rate: float,
    noise: float,
) -> tuple[float, float, int]:
    """Return the sums of v^2 / F and of log F over the innovations v of variance F, and their number."""
    m, P, Phi = np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3))
    squares, logs, count = 0.0, 0.0, 0
    for i in range(value.size):
        if start[i]:
            m[:] = 0.0
            begin(P, tau_s, spread, rate, noise)
        else:
            predict(P, Phi, duration_s[i], step_m[i], turn[i], tau_s, spread, rate)
            m = Phi @ m
        if not usable[i]:
            continue
        F = P[0, 0] + noise * noise
        v = value[i] - m[0]
        K = P[:, 0] / F
        m += K * v
        P -= np.outer(K, K) * F
        if not start[i]:  # the first value of a piece only says what the sensor holds
            squares += v * v / F
            logs += math.log(F)
            count += 1
    return squares, logs, count


@njit(cache=True, nogil=True)
def smooth(
    value: NDArray[np.float64],
    usable: NDArray[np.bool_],
    duration_s: NDArray[np.float64],
    step_m: NDArray[np.float64],
    turn: NDArray[np.float64],
    start: NDArray[np.bool_],
    tau_s: float,
    spread: float,
    rate: float,
    noise: float,
) -> tuple[
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
]:
    """Return smoothed states and what covariances between them are made of.

    Returns
    -------
    state : array of float64 (n, 3)
        Sensor, air, slope.
    covariance : array of float64 (n, 3, 3)
    predicted : array of float64 (n, 3, 3)
        Covariance before the sample's own value.
    adjoint : array of float64 (n, 3, 3)
        N of Durbin and Koopman: ``covariance = P - P N P``.
    link : array of float64 (n, 3, 3)
        L: from the state at a sample to the next one, after the sample's own value.
    """
    n = value.size
    state, covariance = np.zeros((n, 3)), np.zeros((n, 3, 3))
    predicted, adjoint, link = np.zeros((n, 3, 3)), np.zeros((n, 3, 3)), np.zeros((n, 3, 3))
    innovation, variance = np.zeros(n), np.ones(n)
    m, P, Phi = np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3))
    for i in range(n):
        if start[i]:
            m[:] = 0.0
            begin(P, tau_s, spread, rate, noise)
        else:
            predict(P, Phi, duration_s[i], step_m[i], turn[i], tau_s, spread, rate)
            m = Phi @ m
            link[i - 1] = Phi @ link[i - 1]
        state[i] = m
        predicted[i] = P
        link[i] = np.eye(3)
        if usable[i]:
            innovation[i], variance[i] = value[i] - m[0], P[0, 0] + noise * noise
            K = P[:, 0] / variance[i]
            link[i, :, 0] -= K
            m += K * innovation[i]
            P -= np.outer(K, K) * variance[i]
    r, N = np.zeros(3), np.zeros((3, 3))
    for i in range(n - 1, -1, -1):
        if i == n - 1 or start[i + 1]:
            r[:] = 0.0
            N[:, :] = 0.0
        else:
            r = link[i].T @ r
            N = link[i].T @ N @ link[i]
        if usable[i]:
            r[0] += innovation[i] / variance[i]
            N[0, 0] += 1.0 / variance[i]
        adjoint[i] = N
        state[i] += predicted[i] @ r
        covariance[i] = predicted[i] - predicted[i] @ N @ predicted[i]
    return state, covariance, predicted, adjoint, link


@njit(cache=True, nogil=True)
def mean_variances(
    first: NDArray[np.int64],
    last: NDArray[np.int64],
    predicted: NDArray[np.float64],
    adjoint: NDArray[np.float64],
    link: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the variance of the mean air over each run of samples, the errors of neighbours being correlated.

    For j >= i, ``Cov(x_i, x_j) = P_i L_i^T ... L_{j-1}^T (I - N_j P_j)`` (Durbin and Koopman 2012, section 4.7).
    """
    variances = np.zeros(first.size)
    for run in range(first.size):
        total = 0.0
        U = np.zeros((3, 3))
        for i in range(last[run], first[run] - 1, -1):
            own = np.eye(3) - adjoint[i] @ predicted[i]
            U = own if i == last[run] else own + link[i].T @ U
            total += 2.0 * (predicted[i] @ U)[1, 1] - (predicted[i] @ own)[1, 1]
        variances[run] = total / (last[run] - first[run] + 1) ** 2
    return variances
