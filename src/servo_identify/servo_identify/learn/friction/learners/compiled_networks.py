"""Trained networks as plain arrays, evaluated compiled: no torch where they run."""

from __future__ import annotations

from numba import njit
import numpy as np


@njit(cache=True)
def dense(x, w1, b1, w2, b2, w3, b3):
    """Return two hidden layers of tanh and a linear output, of one row of features."""
    return (w3 @ np.tanh(w2 @ np.tanh(w1 @ x + b1) + b2) + b3)[0]


@njit(cache=True)
def convolution(x, w1, b1, w2, b2, w3, b3):
    """Return two valid convolutions of relu, the mean over time and a linear output."""
    for w, b in ((w1, b1), (w2, b2)):
        width = w.shape[2]
        out = np.empty((len(x) - width + 1, w.shape[0]))
        for k in range(len(out)):
            for c in range(w.shape[0]):
                total = b[c]
                for j in range(width):
                    for i in range(w.shape[1]):
                        total += w[c, i, j] * x[k + j, i]
                out[k, c] = max(0.0, total)
        x = out
    mean = np.zeros(x.shape[1])
    for k in range(len(x)):
        mean += x[k]
    return (w3 @ (mean / len(x)) + b3)[0]


@njit(cache=True)
def recurrent(x, wi, wh, b, wo, bo):
    """Return an LSTM (paper 003 eq. 7 to 12; gates in torch's order) and its linear output."""
    m = wh.shape[1]
    hidden, cell = np.zeros(m), np.zeros(m)
    for k in range(len(x)):
        gates = wi @ x[k] + wh @ hidden + b
        for j in range(m):
            enter = 1.0 / (1.0 + np.exp(-gates[j]))
            keep = 1.0 / (1.0 + np.exp(-gates[m + j]))
            leave = 1.0 / (1.0 + np.exp(-gates[3 * m + j]))
            cell[j] = keep * cell[j] + enter * np.tanh(gates[2 * m + j])
            hidden[j] = leave * np.tanh(cell[j])
    return (wo @ hidden + bo)[0]


@njit(cache=True)
def _normed(x, gain, shift):
    out = np.empty_like(x)
    for k in range(len(x)):
        out[k] = (x[k] - x[k].mean()) / np.sqrt(x[k].var() + 1e-5) * gain + shift
    return out


@njit(cache=True)
def attention(x, we, be, at, wq, bq, wp, bp, g1, s1, w1, b1, w2, b2, g2, s2, wo, bo, heads):
    """Return one encoder layer over the window, read at its last sample."""
    d = we.shape[0]
    x = x @ we.T + be + at
    q = x @ wq.T + bq
    part = d // heads
    mixed = np.zeros_like(x)
    for head in range(heads):
        lo = head * part
        for k in range(len(x)):
            weight = np.zeros(len(x))
            for j in range(len(x)):
                for i in range(part):
                    weight[j] += q[k, lo + i] * q[j, d + lo + i]
            weight = np.exp((weight - weight.max()) / np.sqrt(part))
            weight /= weight.sum()
            for j in range(len(x)):
                for i in range(part):
                    mixed[k, lo + i] += weight[j] * q[j, 2 * d + lo + i]
    x = _normed(x + mixed @ wp.T + bp, g1, s1)
    inner = np.maximum(x @ w1.T + b1, 0.0)
    x = _normed(x + inner @ w2.T + b2, g2, s2)
    return (wo @ x[-1] + bo)[0]
