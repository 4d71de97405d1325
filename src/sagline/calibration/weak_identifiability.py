"""Weakly identifiable parameters: combinations with little information beyond the prior, and correlated pairs."""

from __future__ import annotations

import re
from itertools import combinations
from typing import Final, NamedTuple

import numpy as np

from sagline.calibration.findings import Direction
from sagline.calibration.identifiability import PriorUnits, easiest_measurement, measurement_rank, prior_units
from sagline.calibration.parameters import Parameters
from sagline.core.arrays import Array, Flags, Indices, locked

LITTLE: Final = 0.5  # of the prior's deviation: where more is left, the readings said little
ALIKE: Final = 0.98  # correlation: beyond it two numbers are known five times worse than their sum or difference
_MOST: Final = 0.8  # of a direction's square, which the numbers that name it must have
_NAMES: Final = 3
_SINGULAR: Final = 1e-10  # of all variances: numbers that do alike to so much are one
_TINY: Final = 1e-300


class Group(NamedTuple):
    """Numbers of one kind and axis, of all cables or a single one.

    Attributes:
        name: "frame_anchors z".
        members: Their indices.
    """

    name: str
    members: Indices


def cannot_tell_apart(triangle: Array, parameters: Parameters, gauge: tuple[Direction, ...]) -> tuple[Direction, ...]:
    """Weakly identifiable directions, without the unobservable ones.

    Directions with more than `LITTLE` of the prior deviation left, the least known first; then parameters with a
    correlation beyond `ALIKE`, and single parameters that those of all cables substitute.
    """
    frame = prior_units(parameters)
    complement = _complement(frame, gauge)
    if not complement.shape[1]:
        return ()
    seen = (triangle * frame.scale) @ complement
    groups = _groups(parameters, frame)
    little = _weak_directions(triangle, seen, complement, parameters, frame, groups)
    names = [one.name for one in little]
    alike = _correlated_pairs(seen, complement, parameters, frame, groups)
    return (*little, *(one for one in alike if one.name not in names))


def _complement(frame: PriorUnits, gauge: tuple[Direction, ...]) -> Array:
    """Orthonormal directions of what is unknown and told, in standard deviations of the priors, (P, k)."""
    count = len(frame.scale)
    fixed = np.eye(count)[:, np.setdiff1d(np.arange(count), frame.free)]
    left = np.array([one.vector / frame.units for one in gauge]).reshape(len(gauge), count).T
    taken = np.hstack((fixed, left))
    vectors, _, _ = np.linalg.svd(taken, full_matrices=True)
    found: Array = vectors[:, taken.shape[1] :]
    return found


def _groups(parameters: Parameters, frame: PriorUnits) -> list[Group]:
    """The numbers by kind and axis."""
    members: dict[str, list[int]] = {}
    for index in map(int, frame.free):
        axis = parameters.labels[index].rpartition(".")[2] if "." in parameters.labels[index] else ""
        members.setdefault(f"{parameters.names[index]} {axis}".rstrip(), []).append(index)
    return [Group(name, np.array(each)) for name, each in members.items()]


def _weak_directions(
    triangle: Array, seen: Array, complement: Array, parameters: Parameters, frame: PriorUnits, groups: list[Group]
) -> list[Direction]:
    """Directions of which little is told; those that the same numbers make are one, with their count."""
    _, sizes, rows = np.linalg.svd(seen, full_matrices=True)
    sizes = np.concatenate((sizes, np.zeros(len(rows) - len(sizes))))
    left = 1.0 / np.hypot(1.0, sizes)
    vectors = complement @ rows.T
    kinds = np.array([measurement_rank(name) for name in parameters.names])
    member = np.array([np.isin(np.arange(len(kinds)), group.members) for group in groups], dtype=np.float64)
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


def _words(
    vector: Array, parameters: Parameters, groups: list[Group], kinds: Indices, member: Array
) -> tuple[str, ...]:
    """Names of a direction (P,): kinds of parameters, or the axis or single parameter that has nearly all of it.

    kinds: rank of each parameter's kind (P,); member: 1 where a group has a parameter, else 0, (g, P).
    """
    square = vector**2
    shares = np.bincount(kinds, square, minlength=kinds.max() + 1)
    order = np.argsort(-shares, kind="stable")
    needed = int(np.searchsorted(np.cumsum(shares[order]), _MOST * shares.sum())) + 1
    names = []
    for kind in np.sort(order[: min(needed, _NAMES)]):
        own = np.where(kinds == kind, square, 0.0)
        largest = int(np.argmax(own))
        group = groups[int(np.argmax(member @ own))]
        if own[largest] > _MOST * own.sum():
            names.append(parameters.labels[largest])
        elif own[group.members].sum() > _MOST * own.sum():
            names.append(group.name)
        else:
            names.append(parameters.names[largest])
    return tuple(names)


def _substitutes(scaled: Array, index: int, groups: list[Group]) -> tuple[str, ...]:
    """The numbers of one other group, or of two, that do nearly all that a number does to the readings."""
    others = [group for group in groups if index not in group.members]
    for count in (1, 2):
        best: tuple[str, ...] = ()
        least = 1.0
        for chosen in combinations(others, count):
            members = np.concatenate([group.members for group in chosen])
            answer = np.linalg.lstsq(scaled[:, members], scaled[:, index], rcond=1e-9)[0]
            missed = np.linalg.norm(scaled[:, index] - scaled[:, members] @ answer)
            left = float(missed / max(float(np.linalg.norm(scaled[:, index])), _TINY))
            if left < least:
                best, least = tuple(group.name for group in chosen), left
        if least < np.sqrt(1.0 - ALIKE**2):
            return best
    return ()


def _correlated_pairs(
    seen: Array, complement: Array, parameters: Parameters, frame: PriorUnits, groups: list[Group]
) -> list[Direction]:
    """Pairs of numbers, the worst of each two groups; and single numbers with groups that imitate them."""
    known = np.isfinite(parameters.prior_deviation)[:, None] * complement
    _, sizes, rows = np.linalg.svd(np.vstack((seen, known)), full_matrices=False)
    spread = complement @ rows.T / np.maximum(sizes, _TINY)
    scatter = spread @ spread.T
    size = np.sqrt(np.maximum(scatter.diagonal(), _TINY))
    likeness = np.abs(scatter) / np.outer(size, size)
    np.fill_diagonal(likeness, 0.0)
    imitated = {many.name: _is_substituted(scatter, many.members) for many in groups if len(many.members) > 1}
    found = []
    for first, one in enumerate(groups):
        for other in groups[first:]:
            pair = _pair(likeness, one, other)
            if pair is not None:
                names = (parameters.labels[pair[0]], parameters.labels[pair[1]])
                found.append(_least_known_combination(scatter, np.array(pair), names, frame))
            elif min(len(one.members), len(other.members)) == 1 and one is not other:
                single, many = (one, other) if len(one.members) == 1 else (other, one)
                if len(many.members) > 1 and imitated[many.name][single.members[0]]:
                    members = np.concatenate((single.members, many.members))
                    found.append(_least_known_combination(scatter, members, (single.name, many.name), frame))
    return sorted(found, key=lambda one: -one.known)


def _pair(likeness: Array, one: Group, other: Group) -> tuple[int, int] | None:
    """The two numbers of two groups that are most alike, if they are; likeness: their correlations, without signs."""
    block = likeness[one.members[:, None], other.members]
    row, column = divmod(int(block.argmax()), block.shape[1])
    return (int(one.members[row]), int(other.members[column])) if block[row, column] > ALIKE else None


def _is_substituted(scatter: Array, many: Indices) -> Flags:
    """True if what the numbers of many cables do is all but what each does, (P,): their multiple correlation."""
    within, between = scatter[np.ix_(many, many)], scatter[many]
    ridge = (_SINGULAR * float(np.trace(within)) + _TINY) * np.eye(len(many))
    share = np.sum(between * np.linalg.solve(within + ridge, between), axis=0)
    imitated: Flags = share > ALIKE**2 * np.maximum(scatter.diagonal(), _TINY)
    return imitated


def _least_known_combination(scatter: Array, members: Indices, names: tuple[str, ...], frame: PriorUnits) -> Direction:
    """The combination of some numbers that is known least."""
    values, vectors = np.linalg.eigh(scatter[np.ix_(members, members)])
    left = float(np.sqrt(max(values[-1], 0.0)))
    vector = np.zeros(len(scatter))
    vector[members] = left * vectors[:, -1]
    return _direction(names, "", vector, left, frame)


def _direction(
    names: tuple[str, ...], many: str, vector: Array, left: float, frame: PriorUnits, *, alone: bool = False
) -> Direction:
    """A direction by its names; where it is one number alone, which others imitate, that is what to measure."""
    vector = vector * np.sign(vector[np.argmax(np.abs(vector))])
    step = easiest_measurement(re.split(r"[ .[]", name)[0] for name in (names[:1] if alone else names))
    name = " with ".join((names[0], " and ".join(names[1:]))) if names[1:] else names[0]
    return Direction(name + many, locked(frame.units * vector), min(left, 1.0), step)
