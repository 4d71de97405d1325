"""A small catalogue of ropes for cables. The diameter determines the properties; each rope names its source."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from sagline.cables.cable import Cable
from sagline.core.arrays import checked

SAFETY = 5.0  # breaking force divided by the highest allowed tension; usual value for general lifting


@dataclass(frozen=True, slots=True)
class Rope:
    """A type of rope whose properties are proportional to the square of its diameter.

    Attributes:
        name: Name in the catalogue.
        description: Description of the rope.
        density_factor: Linear density divided by the squared diameter [kg/m^3].
        stiffness_factor: Axial stiffness divided by the squared diameter [Pa].
        strength_factor: Breaking force divided by the squared diameter [Pa].
        source: Source of the numbers.
        assumed: Assumed values, and the reasons.
    """

    name: str
    description: str
    density_factor: float
    stiffness_factor: float
    strength_factor: float
    source: str
    assumed: str

    def cable(self, diameter: float) -> Cable:
        """A cable of this rope with the diameter `diameter` [m]."""
        square = float(checked(diameter, "diameter", "m", shape=(), above=0.0)) ** 2
        return Cable(self.density_factor * square, self.stiffness_factor * square, diameter=diameter)

    def breaking_force(self, diameter: float) -> float:
        """Minimum breaking force [N] of a new rope with the diameter `diameter` [m]."""
        return self.strength_factor * diameter**2


def _steel(name: str, construction: str, mass: float, section: float, strength: float) -> Rope:
    """A steel rope from the factors of EN 12385-4: length mass W [kg/(100 m mm^2)], metallic section C, strength K."""
    return Rope(
        name=name,
        description=f"steel wire rope {construction}, grade 1770",
        density_factor=1e4 * mass,
        stiffness_factor=_STEEL_MODULUS * section,
        strength_factor=1.77e9 * strength,
        source=f"EN 12385-4, calculation factors of {construction}: W = {mass}, C = {section}, K = {strength}",
        assumed="modulus 100 GPa on the metallic section, usual after run-in; manufacturers state their own values",
    )


def _braid(name: str, fiber: str, modulus: float, strength: float, source: str) -> Rope:
    """A braided rope from the modulus [Pa] and the strength [Pa] of its fiber."""
    section = 0.7853981633974483 * _BRAID_FILL
    return Rope(
        name=name,
        description=f"12-strand braid of {fiber}",
        density_factor=_POLYETHYLENE * section,
        stiffness_factor=0.5 * modulus * section,
        strength_factor=0.55 * strength * section,
        source=source,
        assumed="fiber fills two thirds of the rope's circle, and the braid keeps 50 % of its modulus and 55 % of its "
        "strength: usual values for a braid after run-in; manufacturers state their own values",
    )


_STEEL_MODULUS = 100e9  # modulus for the metallic section [Pa]
_BRAID_FILL = 2.0 / 3.0  # fiber area divided by the area of the circle with the nominal diameter
_POLYETHYLENE = 975.0  # [kg/m^3], assumed: a common value of the fiber
_DSM = "DSM Dyneema, fact sheet UHMWPE fiber, CIS YA100 (2010): {}; density 975 kg/m^3 assumed"

ROPES: Final = MappingProxyType(
    {
        rope.name: rope
        for rope in (
            _braid("dyneema-sk78", "Dyneema SK78", 109e9, 3.3e9, _DSM.format("SK78 at least 109 GPa, 3.3 GPa")),
            _braid("dyneema-sk62", "Dyneema SK62", 65e9, 2.4e9, _DSM.format("SK62 at least 65 GPa, 2.4 GPa")),
            _steel("steel-6x19", "6x19 with a steel core (IWRC)", 0.400, 0.449, 0.356),
            _steel("steel-7x19", "7x19 (6x19M with a strand core, WSC)", 0.381, 0.418, 0.362),
        )
    }
)
