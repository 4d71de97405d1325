"""Cable on a drum with its winding tension: bins of cable, each at one strain."""

from __future__ import annotations

from sagline.core.arrays import Array
from sagline.kernels.jit import formula, kernel

BIN = 0.005  # m of cable on the drum that lie at one tension


@kernel
def wind_in(layer: Array, place: float, step: float, strain: float, stiffness: float) -> float:
    """Put cable of a strain on a drum; returns the energy [J] that is lost where it is shared with what lies there.

    What lies in a bin has one strain, that with which it is as long as it was, strained and unstrained.

    Args:
        layer: Strain of the cable on the drum, bin by bin, (B,); what is beyond the last border is the last bin's.
        place: What is let out before [m].
        step: How much of it is wound in [m], > 0.
        strain: Of this.
        stiffness: EA [N].
    """
    lost = 0.0
    first, last = _bin_of(layer, place - step), _bin_of(layer, place)
    for k in range(first, last + 1):
        begin = max(place - step, k * BIN) if k > first else place - step
        middle = min(place, (k + 1) * BIN) if k < last else place
        if k == layer.shape[0] - 1:  # endless, it takes the winding strain
            lost += 0.5 * stiffness * (strain - layer[k]) ** 2 * (middle - begin) / (1.0 + strain)
            continue
        new, old = (middle - begin) / (1.0 + strain), max((k + 1) * BIN - middle, 0.0) / (1.0 + layer[k])
        if new + old > 0.0:
            shared = new / (new + old)
            lost += 0.5 * stiffness * (1.0 - shared) * new * (strain - layer[k]) ** 2
            layer[k] += shared * (strain - layer[k])
    return lost


@kernel
def pay_out(layer: Array, place: float, step: float, stiffness: float) -> tuple[float, float]:
    """Strain of the cable that a drum lets out, as one, and the energy [J] that is lost by this.

    Args:
        layer: Strain of the cable on the drum, bin by bin, (B,); what is beyond the last border is the last bin's.
        place: What is let out before [m].
        step: How much more [m], > 0.
        stiffness: EA [N].
    """
    first, last = _bin_of(layer, place), _bin_of(layer, place + step)
    if first == last:
        return layer[first], 0.0
    length, strained, squares = 0.0, 0.0, 0.0
    for k in range(first, last + 1):
        begin = max(place, k * BIN) if k > first else place
        end = min(place + step, (k + 1) * BIN) if k < last else place + step
        part = (end - begin) / (1.0 + layer[k])
        length, strained, squares = length + part, strained + part * layer[k], squares + part * layer[k] * layer[k]
    mean = strained / length
    return mean, 0.5 * stiffness * (squares - mean * strained)


@formula
def _bin_of(layer: Array, place: float) -> int:
    """The bin of a place [m] along the cable."""
    return min(max(int(place / BIN), 0), layer.shape[0] - 1)
