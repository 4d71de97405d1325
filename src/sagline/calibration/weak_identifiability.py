"""Weakly identifiable parameters: combinations about which the readings contain little information."""

from __future__ import annotations

import re
from itertools import combinations, combinations_with_replacement
from typing import Final

import numpy as np

from sagline.calibration.findings import Direction
from sagline.calibration.identifiability import easiest_measurement, measurement_rank
from sagline.calibration.parameters import Parameters, PriorUnits
from sagline.core.arrays import Array, Flags, Indices, locked

LITTLE: Final = 0.5  # a direction is weakly identifiable if a larger share of its prior deviation remains
ALIKE: Final = 0.98  # correlation at which two parameters have five times the error of their sum or difference
_MOST: Final = 0.8  # the names of a direction represent at least this share of its squared length
_NAMES: Final = 3
_SINGULAR: Final = 1e-10  # variances below this share of the sum of variances are rounding errors
_TINY: Final = 1e-300


Groups = dict[str, Indices]  # name of a kind and axis, such as "frame_anchors z", and indices of its parameters


def weak_directions(triangle: Array, parameters: Parameters, gauge: tuple[Direction, ...]) -> tuple[Direction, ...]:
    """Weakly identifiable directions, without the unobservable directions."""
    # The result begins with directions that keep more than the share `LITTLE` of the prior deviation, the largest share
    # first. Next are pairs of parameters with a correlation above `ALIKE`. The last are single parameters that change
    # the readings as a combination of parameters of all cables does.
    frame = PriorUnits(parameters)
    complement = _complement(frame, gauge)
    if not complement.shape[1]:
        return ()
    seen = (triangle * frame.scale) @ complement
    groups = _groups(parameters, frame)
    little = _little_observed(triangle, seen, complement, parameters, frame, groups)
    names = [one.name for one in little]
    alike = _correlated_pairs(seen, complement, parameters, frame, groups)
    return (*little, *(one for one in alike if one.name not in names))


def _complement(frame: PriorUnits, gauge: tuple[Direction, ...]) -> Array:
    """Orthonormal basis (P, k) of the observable directions, in standard deviations of the priors."""
    count = len(frame.scale)
    fixed = np.eye(count)[:, np.setdiff1d(np.arange(count), frame.free)]
    left = np.array([one.vector / frame.units for one in gauge]).reshape(len(gauge), count).T
    taken = np.hstack((fixed, left))
    vectors, _, _ = np.linalg.svd(taken, full_matrices=True)
    return np.asarray(vectors[:, taken.shape[1] :])


def _groups(parameters: Parameters, frame: PriorUnits) -> Groups:
    """Indices of the parameters, grouped by kind and axis."""
    members: dict[str, list[int]] = {}
    for index in map(int, frame.free):
        axis = parameters.labels[index].rpartition(".")[2] if "." in parameters.labels[index] else ""
        members.setdefault(f"{parameters.names[index]} {axis}".rstrip(), []).append(index)
    return {name: np.array(each) for name, each in members.items()}


def _little_observed(
    triangle: Array, seen: Array, complement: Array, parameters: Parameters, frame: PriorUnits, groups: Groups
) -> list[Direction]:
    """Directions about which the readings contain little information; directions with equal names are joined."""
    _, sizes, rows = np.linalg.svd(seen, full_matrices=True)
    sizes = np.concatenate((sizes, np.zeros(len(rows) - len(sizes))))
    left = 1.0 / np.hypot(1.0, sizes)
    vectors = complement @ rows.T
    kinds = np.array([measurement_rank(name) for name in parameters.names])
    member = np.array([np.isin(np.arange(len(kinds)), members) for members in groups.values()], dtype=np.float64)
    alike: dict[tuple[str, ...], list[int]] = {}
    for index in map(int, np.argsort(-left, kind="stable")):
        if left[index] > LITTLE:
            alike.setdefault(_words(vectors[:, index], parameters, groups, kinds, member), []).append(index)
    found = []
    for names, each in alike.items():
        alone = len(names) == 1 and names[0] in parameters.labels
        if alone:
            index = parameters.labels.index(names[0])
            names = (names[0], *_substitutes(triangle * frame.scale, index, groups))
        many = f" ({len(each)} directions)" if len(each) > 1 else ""
        worst = each[0]
        found.append(_direction(names, many, vectors[:, worst] * left[worst], float(left[worst]), frame, alone=alone))
    return found


def _words(vector: Array, parameters: Parameters, groups: Groups, kinds: Indices, member: Array) -> tuple[str, ...]:
    """Names for the direction `vector` (P,), one for each of its main kinds of parameters."""
    # kinds: index (P,) of each parameter's kind; member: matrix (g, P) with 1 for each parameter of a group.
    square = vector**2
    shares = np.bincount(kinds, square, minlength=kinds.max() + 1)
    order = np.argsort(-shares, kind="stable")
    needed = int(np.searchsorted(np.cumsum(shares[order]), _MOST * shares.sum())) + 1
    names = []
    for kind in np.sort(order[: min(needed, _NAMES)]):
        own = np.where(kinds == kind, square, 0.0)
        largest = int(np.argmax(own))
        group = list(groups)[int(np.argmax(member @ own))]
        if own[largest] > _MOST * own.sum():
            names.append(parameters.labels[largest])
        elif own[groups[group]].sum() > _MOST * own.sum():
            names.append(group)
        else:
            names.append(parameters.names[largest])
    return tuple(names)


def _substitutes(scaled: Array, index: int, groups: Groups) -> tuple[str, ...]:
    """Names of one or two groups of parameters that can change the readings nearly as the parameter `index` does."""
    others = [name for name, members in groups.items() if index not in members]
    for count in (1, 2):
        best: tuple[str, ...] = ()
        least = 1.0
        for names in combinations(others, count):
            members = np.concatenate([groups[name] for name in names])
            effect = np.linalg.lstsq(scaled[:, members], scaled[:, index], rcond=1e-9)[0]
            missed = np.linalg.norm(scaled[:, index] - scaled[:, members] @ effect)
            left = float(missed / max(float(np.linalg.norm(scaled[:, index])), _TINY))
            if left < least:
                best, least = names, left
        if least < np.sqrt(1.0 - ALIKE**2):
            return best
    return ()


def _correlated_pairs(
    seen: Array, complement: Array, parameters: Parameters, frame: PriorUnits, groups: Groups
) -> list[Direction]:
    """Strongly correlated pairs of parameters, and single parameters with the same effect as a group of parameters."""
    known = np.isfinite(parameters.prior_deviation)[:, None] * complement
    _, sizes, rows = np.linalg.svd(np.vstack((seen, known)), full_matrices=False)
    spread = complement @ rows.T / np.maximum(sizes, _TINY)
    scatter = spread @ spread.T
    size = np.sqrt(np.maximum(scatter.diagonal(), _TINY))
    likeness = np.abs(scatter) / np.outer(size, size)
    np.fill_diagonal(likeness, 0.0)
    substituted = {name: _is_substituted(scatter, many) for name, many in groups.items() if len(many) > 1}
    found = []
    for one, other in combinations_with_replacement(groups, 2):
        first, second = groups[one], groups[other]
        pair = _most_correlated(likeness, first, second)
        if pair is not None:
            names = (parameters.labels[pair[0]], parameters.labels[pair[1]])
            found.append(_least_known_combination(scatter, np.array(pair), names, frame))
        elif min(len(first), len(second)) == 1 and one != other:
            single, many = (one, other) if len(first) == 1 else (other, one)
            if len(groups[many]) > 1 and substituted[many][groups[single][0]]:
                members = np.concatenate((groups[single], groups[many]))
                found.append(_least_known_combination(scatter, members, (single, many), frame))
    return sorted(found, key=lambda one: -one.known)


def _most_correlated(likeness: Array, first: Indices, second: Indices) -> tuple[int, int] | None:
    """Most correlated pair of parameters of two groups; None below `ALIKE`; likeness: absolute correlations (P, P)."""
    block = likeness[first[:, None], second]
    row, column = divmod(int(block.argmax()), block.shape[1])
    return (int(first[row]), int(second[column])) if block[row, column] > ALIKE else None


def _is_substituted(scatter: Array, many: Indices) -> Flags:
    """True (P,) for each parameter with a multiple correlation above `ALIKE` with the parameters `many`."""
    within, between = scatter[np.ix_(many, many)], scatter[many]
    ridge = (_SINGULAR * float(np.trace(within)) + _TINY) * np.eye(len(many))
    share = np.sum(between * np.linalg.solve(within + ridge, between), axis=0)
    return np.asarray(share > ALIKE**2 * np.maximum(scatter.diagonal(), _TINY))


def _least_known_combination(scatter: Array, members: Indices, names: tuple[str, ...], frame: PriorUnits) -> Direction:
    """Direction among the parameters `members` that has the largest error."""
    values, vectors = np.linalg.eigh(scatter[np.ix_(members, members)])
    left = float(np.sqrt(max(values[-1], 0.0)))
    vector = np.zeros(len(scatter))
    vector[members] = left * vectors[:, -1]
    return _direction(names, "", vector, left, frame)


def _direction(
    names: tuple[str, ...], many: str, vector: Array, left: float, frame: PriorUnits, *, alone: bool = False
) -> Direction:
    """Direction with a name and a recommended measurement; alone: True to measure only the first parameter."""
    vector = vector * np.sign(vector[np.argmax(np.abs(vector))])
    step = easiest_measurement(re.split(r"[ .[]", name)[0] for name in (names[:1] if alone else names))
    name = " with ".join((names[0], " and ".join(names[1:]))) if names[1:] else names[0]
    return Direction(name + many, locked(frame.units * vector), min(left, 1.0), step)
