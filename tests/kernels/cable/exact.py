"""The elastic catenary in multi-precision arithmetic."""

from __future__ import annotations

from decimal import Decimal, localcontext

DIGITS = 60
SMALL = Decimal("1e-25")


def asinh(v: Decimal) -> Decimal:
    return ((abs(v) + (v * v + 1).sqrt()).ln()).copy_sign(v)


def exact_end(t_x: Decimal, t_z: Decimal, length: Decimal, w: Decimal, ea: Decimal) -> tuple[Decimal, Decimal]:
    """(1)-(4) of the article, as printed, at s = L."""
    low = t_z - w * length
    x = t_x * length / ea + t_x / w * (asinh(t_z / t_x) - asinh(low / t_x))
    z = t_z * length / ea - w * length**2 / (2 * ea) + ((t_x**2 + t_z**2).sqrt() - (t_x**2 + low**2).sqrt()) / w
    return x, z


def length_and_pull(
    span: float, rise: float, w: float, ea: float, tension: float, near: tuple[float, float]
) -> tuple[Decimal, Decimal]:
    """Unstrained length and T_z - tau sin phi at a chord tension, by Newton steps from close values."""
    with localcontext() as context:
        context.prec = DIGITS
        x, z, weight, stiffness = (Decimal(v) for v in (span, rise, w, ea))
        chord = (x * x + z * z).sqrt()
        t_x, base = Decimal(tension) * x / chord, Decimal(tension) * z / chord
        length, sag_force = Decimal(near[0]), Decimal(near[1])
        for _ in range(40):
            here = exact_end(t_x, base + sag_force, length, weight, stiffness)
            by_length = exact_end(t_x, base + sag_force, length * (1 + SMALL), weight, stiffness)
            by_sag_force = exact_end(t_x, base + sag_force * (1 + SMALL), length, weight, stiffness)
            a, c = ((v - u) / (length * SMALL) for u, v in zip(here, by_length, strict=True))
            b, d = ((v - u) / (sag_force * SMALL) for u, v in zip(here, by_sag_force, strict=True))
            miss_x, miss_z = x - here[0], z - here[1]
            determinant = a * d - b * c
            step = (d * miss_x - b * miss_z) / determinant
            length += step
            sag_force += (a * miss_z - c * miss_x) / determinant
            if abs(step) < Decimal("1e-32") * length:
                return length, sag_force
    raise ArithmeticError("no cable found near there")
