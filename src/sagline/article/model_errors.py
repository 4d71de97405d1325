"""How good each cable model is, and where."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sagline.article.identify import position_error
from sagline.article.sampling import GRAVITY
from sagline.cables.cable import Cable
from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, Elastic, Empirical, Parabolic, Straight
from sagline.core.arrays import Array, checked

MODELS: tuple[CableModel, ...] = (Straight(), Elastic(), Empirical(), Parabolic(), Catenary())  # coarse to exact


@dataclass(frozen=True, slots=True, eq=False)
class ModelErrors:
    """Errors of the five models for every combination of four quantities of a cable, against the exact one.

    All models are asked for the same horizontal tension, so a length error is what a winch would wind wrongly, and a
    position error, |dx| + |dz| of (20), is how far the end of an exact cable with the model's force and length is
    from where it should be.

    Attributes:
        models: The models, shape (5,).
        axial_stiffness: EA [N].
        chords: D [m], shape (c,).
        angles: phi [rad], shape (a,).
        densities: rho [kg/m], shape (r,).
        tensions: Chord tension tau [N], shape (t,).
        length_error: L of the model less the exact one [m], shape (5, c, a, r, t).
        force_error: T_z of the model less the exact one [N], shape (5, c, a, r, t).
        position_error: [m], shape (5, c, a, r, t).
    """

    models: tuple[CableModel, ...]
    axial_stiffness: float
    chords: Array
    angles: Array
    densities: Array
    tensions: Array
    length_error: Array
    force_error: Array
    position_error: Array

    def sufficient(self, tolerance: float) -> Array:
        """The coarsest model that will do.

        Args:
            tolerance: Largest length error allowed [m].

        Returns:
            Its number among the models, shape (c, a, r, t).
        """
        within = np.abs(self.length_error) <= tolerance
        coarsest: Array = np.argmax(within, axis=0).astype(np.float64)
        return coarsest


def model_errors(
    axial_stiffness: float, chords: ArrayLike, angles: ArrayLike, densities: ArrayLike, tensions: ArrayLike
) -> ModelErrors:
    """Compare the five models on a grid.

    Args:
        axial_stiffness: EA [N], > 0.
        chords: D [m], shape (c,), > 0.
        angles: Chord angle phi [rad], shape (a,), positive with the platform end above the frame end.
        densities: rho [kg/m], shape (r,), > 0.
        tensions: Chord tension tau [N], shape (t,), > 0.

    Returns:
        The errors.

    Raises:
        InvalidValueError: If a value is not finite or out of its range.
    """
    axes = (
        checked(chords, "chords", "m", shape=(None,), above=0.0),
        checked(angles, "angles", "rad", shape=(None,)),
        checked(densities, "densities", "kg/m", shape=(None,), above=0.0),
        checked(tensions, "tensions", "N", shape=(None,), above=0.0),
    )
    chord, angle, density, tension = np.meshgrid(*axes, indexing="ij")
    cable, span, rise = Cable(density, axial_stiffness), chord * np.abs(np.cos(angle)), chord * np.sin(angle)
    states = [model.from_tension(cable, span, rise, tension, GRAVITY) for model in MODELS]
    exact = states[-1]
    return ModelErrors(
        MODELS,
        float(axial_stiffness),
        *axes,
        length_error=np.stack([state.unstrained_length - exact.unstrained_length for state in states]),
        force_error=np.stack([state.vertical_force - exact.vertical_force for state in states]),
        position_error=np.stack([position_error(state) for state in states]),
    )
