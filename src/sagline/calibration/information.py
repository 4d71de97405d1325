"""Information of poses on the parameters, and D-optimal choice of poses: greedy, with exchanges."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from sagline.core.arrays import Array, Indices

FEW: Final = 8  # readings a number: with more, exchanges lower no error by a hundredth
OPEN: Final = 1e-12  # of the largest singular value: of a direction with less nothing is known
ROUNDING: Final = 1e-6  # of a direction's square: a number with less of it does not take part in it
CONDITION: Final = 1e-13  # of all that candidates tell: with less beside it, sums are rounding
_WORTH: Final = 1e-9  # of a log det: an exchange that gains less is rounding


class Information:
    """Information of some of N candidates on P parameters, each candidate with k whitened rows.

    Attributes:
        rows: Slopes of the readings by the numbers, shape (N, k, P).
        covariance: Of the numbers, by what is known and what was taken, shape (P, P).
        chosen: CandidatePoses that were taken, in this order.
    """

    def __init__(self, rows: Array, known: Array) -> None:
        """Begin without candidates; known: inverse of the prior covariance (P, P)."""
        self.rows = rows
        self.chosen: list[int] = []
        self._known = known
        self._unit = np.eye(rows.shape[1])
        self.covariance, self._heard = self._recompute()

    def gains(self) -> Array:
        """Gain of log det of the information by each candidate, shape (N,); -1 for those chosen."""
        gains: Array = np.linalg.slogdet(self._unit + self._heard)[1]
        gains[self.chosen] = -1.0
        return gains

    def best(self) -> tuple[int, float]:
        """The candidate that tells most beside what was taken, and by how much it raises the log det."""
        gains = self.gains()
        best = int(np.argmax(gains))
        return best, float(gains[best])

    def take(self, candidate: int) -> None:
        """One more: C - C J^T (1 + J C J^T)^-1 J C, and with it what is heard of all others."""
        rows = self.rows[candidate]
        across = self.covariance @ rows.T
        by = across @ np.linalg.inv(np.linalg.cholesky(self._unit + rows @ across)).T
        self.covariance = self.covariance - by @ by.T
        shares = self.rows @ by
        self._heard -= shares @ shares.transpose(0, 2, 1)
        self.chosen.append(candidate)

    def leave(self, candidate: int) -> None:
        """One less; all is summed anew, because what alone told of a number leaves little but rounding behind."""
        self.chosen.remove(candidate)
        self.covariance, self._heard = self._recompute()

    def _recompute(self) -> tuple[Array, Array]:
        """Covariance, and J C J^T of each candidate, from nothing."""
        root = np.linalg.inv(np.linalg.cholesky(self._known + information_of(self.rows[self.chosen])))
        shares = self.rows @ root.T
        return root.T @ root, shares @ shares.transpose(0, 2, 1)


def prior_information(rows: Array) -> Array:
    """Prior information (P, P) in units of the priors: 1, but no less than rounding of the observations."""
    return np.eye(rows.shape[-1]) * max(1.0, CONDITION * float((rows**2).sum()))


class Choice(NamedTuple):
    """The candidates that tell most together, in the order in which a greedy choice among them takes them.

    Attributes:
        order: Their indices, shape (count,).
        gain: By how much the first k of them raise the log det of what is known, shape (count,).
        deviation: Standard deviations of the numbers by what is known and the first k, shape (count, P).
    """

    order: Indices
    gain: Array
    deviation: Array


def choose_informative(rows: Array, known: Array, count: int) -> Choice:
    """D-optimal choice of `count` candidates: greedy; if few, each exchanged for a better one.

    The greedy choice alone is within 1 - 1/e of the best, as log det is submodular (Nemhauser, Wolsey & Fisher 1978);
    exchanges after Fedorov 1972.
    """
    found = Information(rows, known)
    for _ in range(count):
        found.take(found.best()[0])
    if count < len(rows) and count * rows.shape[1] <= FEW * len(known):
        _exchange(found)
    among = np.array(sorted(found.chosen))
    again = Information(rows[among], known)
    gains, deviations = np.empty(count), np.empty((count, len(known)))
    for k in range(count):
        candidate, gains[k] = again.best()
        again.take(candidate)
        deviations[k] = np.sqrt(np.diag(again.covariance))
    return Choice(among[again.chosen], np.cumsum(gains), deviations)


def _exchange(found: Information) -> None:
    """Each candidate once for the best one beside the others."""
    for candidate in tuple(found.chosen):
        found.leave(candidate)
        gains = found.gains()
        best = int(np.argmax(gains))
        found.take(best if gains[best] > gains[candidate] + _WORTH else candidate)


def deviations_of(rows: Array, held: Array) -> Array:
    """Standard deviations (P,) from whitened slopes (..., P) and inverse prior deviations (P,); infinite if open."""
    whole = np.concatenate((rows.reshape(-1, len(held)), np.diag(held)))
    _, size, vectors = np.linalg.svd(np.linalg.qr(whole, mode="r"))  # what is known is not squared
    there = size > OPEN * size[0]
    variance = ((vectors[there] / size[there, None]) ** 2).sum(axis=0)
    left = (vectors[~there] ** 2).sum(axis=0)
    with np.errstate(divide="ignore"):
        found: Array = np.minimum(np.where(left > ROUNDING, np.inf, np.sqrt(variance)), 1.0 / held)
    return found


def information_of(rows: Array) -> Array:
    """Information J^T J (P, P) of whitened slopes (..., P)."""
    flat = rows.reshape(-1, rows.shape[-1])
    told: Array = flat.T @ flat
    return told
