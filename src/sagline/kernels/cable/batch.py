"""Loops over many cables. An operand of length 1 holds for all of them."""

from __future__ import annotations

import math

from sagline.core.arrays import Array, Codes
from sagline.kernels.cable.catenary import (
    TAUT_STRAIN,
    catenary_end,
    is_ordinary,
    ordinary_length_ratio,
    ordinary_length_ratio_near,
    ordinary_sag_force_ratio,
)
from sagline.kernels.cable.models import from_length, from_tension
from sagline.kernels.cable.terms import Chord, Material, Terms, model_of
from sagline.kernels.codes import CABLE_SOLVED, CATENARY
from sagline.kernels.jit import entry, kernel

CHUNK = 256  # cables at a time: so many buffers of this length stay in the fastest cache
BUFFERS = 11


@kernel
def _copy_chunk(source: Array, start: int, stop: int, target: Array) -> None:
    """Copy a chunk of an operand, or repeat its one value."""
    if source.shape[0] == 1:
        for i in range(stop - start):
            target[i] = source[0]
    else:
        for i in range(stop - start):
            target[i] = source[start + i]


@entry
def batch_from_tension(
    terms: Terms,
    span: Array,
    rise: Array,
    density: Array,
    stiffness: Array,
    tension: Array,
    length_out: Array,
    horizontal_out: Array,
    vertical_out: Array,
    status_out: Codes,
    buffer: Array,
) -> None:
    """Length, forces on the platform end and status of every cable at its chord tension.

    Ordinary catenaries are solved for a whole chunk in loops without branches; what is not ordinary
    is solved again, one by one. One result a loop: with more, the compiler gives up on vectorizing.
    buffer is room, (BUFFERS, CHUNK).
    """
    model = model_of(terms)
    count = length_out.shape[0]
    x, z, rho, ea, tau = buffer[0], buffer[1], buffer[2], buffer[3], buffer[4]
    chord, sine, cosine, half = buffer[5], buffer[6], buffer[7], buffer[8]
    ratio, pull = buffer[9], buffer[10]
    for start in range(0, count, CHUNK):
        stop = min(start + CHUNK, count)
        size = stop - start
        _copy_chunk(span, start, stop, x)
        _copy_chunk(rise, start, stop, z)
        _copy_chunk(density, start, stop, rho)
        _copy_chunk(stiffness, start, stop, ea)
        _copy_chunk(tension, start, stop, tau)
        for i in range(size):
            chord[i] = math.sqrt(x[i] * x[i] + z[i] * z[i])
        for i in range(size):
            sine[i] = z[i] / chord[i]
        for i in range(size):
            cosine[i] = x[i] / chord[i]
        for i in range(size):
            half[i] = 0.5 * rho[i] * model.gravity * chord[i] / tau[i]
        if model.code == CATENARY:
            for i in range(size):
                ratio[i] = ordinary_length_ratio(half[i], sine[i], cosine[i], tau[i] / ea[i])
            stretched = 0
            for i in range(size):
                stretched += 1 if tau[i] > TAUT_STRAIN * ea[i] else 0
            if stretched > 0:
                for i in range(size):
                    ratio[i] = ordinary_length_ratio_near(half[i], sine[i], cosine[i], tau[i] / ea[i], ratio[i])
            for i in range(size):
                pull[i] = ordinary_sag_force_ratio(half[i], sine[i], tau[i] / ea[i], ratio[i]) * tau[i]
            for i in range(size):
                ratio[i] *= chord[i]
        for i in range(size):
            status = CABLE_SOLVED
            if model.code != CATENARY or not is_ordinary(half[i], tau[i] / ea[i]):
                line = Chord(chord[i], sine[i], cosine[i])
                ratio[i], pull[i], status = from_tension(model, line, Material(rho[i], ea[i]), tau[i])
            status_out[start + i] = status
        for i in range(size):
            length_out[start + i] = ratio[i]
        for i in range(size):
            horizontal_out[start + i] = tau[i] * cosine[i]
        for i in range(size):
            vertical_out[start + i] = tau[i] * sine[i] + pull[i]


@entry
def batch_from_length(
    terms: Terms,
    span: Array,
    rise: Array,
    density: Array,
    stiffness: Array,
    length: Array,
    tension_out: Array,
    horizontal_out: Array,
    vertical_out: Array,
    status_out: Codes,
) -> None:
    """Chord tension, forces on the platform end and status of every cable at its unstrained length."""
    model = model_of(terms)
    x = min(span.shape[0] - 1, 1)
    z = min(rise.shape[0] - 1, 1)
    d = min(density.shape[0] - 1, 1)
    e = min(stiffness.shape[0] - 1, 1)
    n = min(length.shape[0] - 1, 1)
    for i in range(tension_out.shape[0]):
        material = Material(density[i * d], stiffness[i * e])
        force, status = from_length(model, span[i * x], rise[i * z], material, length[i * n])
        horizontal_out[i], vertical_out[i], tension_out[i] = force
        status_out[i] = status


@entry
def batch_end(
    horizontal: Array, vertical: Array, length: Array, weight: Array, stiffness: Array, x_out: Array, z_out: Array
) -> None:
    """Platform ends of exact catenaries with the given forces and lengths; all operands of full length."""
    for i in range(x_out.shape[0]):
        x_out[i], z_out[i] = catenary_end(horizontal[i], vertical[i], length[i], weight[i], stiffness[i])
