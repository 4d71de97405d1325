"""Natural frequencies and shapes of a robot whose cables have mass."""

from __future__ import annotations

from dataclasses import dataclass

from sagline.core.arrays import Array
from sagline.core.results import Result
from sagline.dynamics.damping import Damping
from sagline.dynamics.excitation import most_excited
from sagline.dynamics.vibration_status import VibrationStatus
from sagline.motion.path import Path
from sagline.robot.equilibrium import Equilibrium


@dataclass(frozen=True, slots=True, eq=False)
class Vibration(Result):
    """Result of `vibration`: all modes below a frequency, of the platform and of the strings that its cables are.

    Modes have unit modal mass, so that shapes are in m/sqrt(kg); K is their number.

    Attributes:
        state: The state, a single one.
        up_to: Frequency below which all modes are found [Hz].
        damping: What takes energy out of them.
        status: Whether the state has linear vibrations.
        frequency: Of the modes with cable mass [Hz], ascending, shape (K,).
        shape: Motion of the platform (displacement of the center of mass, rotation vector, world axes), one mode a
            column, shape (6, K) [m/sqrt(kg), rad/(sqrt(kg) m)].
        platform_share: Share of the kinetic energy that is the platform's, shape (K,).
        cable_share: Share of it that is each cable's, shape (m, K); with platform_share they sum to 1.
        cable_shape: Displacement of the cables at equally spaced material points from frame to platform end, world
            axes, shape (K, m, P, 3) [m/sqrt(kg)].
        loss: Damping ratio of each mode, to first order in the damping, shape (K,).
        massless_frequency: Of the platform on cables whose mass does not swing [Hz], as in `modes`, shape (n,).
        count: How many modes there are below up_to by the exact count, which needs no mode: K where it is complete.
        negative_directions: Motions in which the platform leaves an unstable equilibrium, one a column, shape (6, d);
            no columns where it is stable.
        slack_cables: Indices of the cables that have no linear vibration.
    """

    state: Equilibrium
    up_to: float
    damping: Damping
    status: VibrationStatus
    frequency: Array
    shape: Array
    platform_share: Array
    cable_share: Array
    cable_shape: Array
    loss: Array
    massless_frequency: Array
    count: int
    negative_directions: Array
    slack_cables: tuple[int, ...]

    @property
    def complete(self) -> bool:
        """Whether none is missing: as many modes as the exact count has."""
        return self.status is VibrationStatus.SOLVED and self.count == self.frequency.size

    def to_shape(self, path: Path) -> Array:
        """The frequencies that a path excites most, for a shaper: see `sagline.to_shape`.

        Args:
            path: A path from rest to rest, best one that ends where the modes were taken.

        Returns:
            Frequencies [Hz], shape (1,) or (2,), the most excited first.

        Raises:
            InvalidValueError: As `sagline.to_shape`.
        """
        return most_excited(self.state, self.frequency, self.shape, path)
