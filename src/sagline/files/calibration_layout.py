"""What a file with a calibration holds."""

from __future__ import annotations

from typing import Final

from sagline.calibration.status import CalibrationStatus, Omission
from sagline.files.variables import Known, Quantity

READ: Final = ("lengths", "counts")  # by Parameters.counted: what was read of the winches
P: Final = ("parameter",)
N: Final = ("pose",)
PARAMETERS: Final = (
    Quantity("parameter_name", "names", P, "", "kind of each number", values=str),
    Quantity("parameter_label", "labels", P, "", "what each number is called", values=str),
    Quantity("parameter_unit", "units", P, "", "unit of each number, 1 for none", values=str),
    Quantity("parameter_cable", "cables", P, "", "cable of each number, -1 for one of all", values=int),
    Quantity("parameter_place", "where", ("kind_row", "cable"), "", "number of each row of kinds, -1", values=int),
    Quantity("prior", "prior", P, "", "what was known beforehand, in the units of the numbers"),
    Quantity("prior_deviation", "prior_deviation", P, "", "its standard deviation", infinite=True),
    Quantity("prior_stated", "stated", P, "", "whether tolerances or the caller said so", values=bool),
    Quantity("logarithmic", "logarithmic", P, "", "whether the logarithm was looked for", values=bool),
)
FOUND: Final = (
    Quantity("length_offset", "length_offset", ("cable",), "m", "to be added to lengths that the machine believes"),
    Quantity("status", "status", (), "", "how the calibration ended", codes=CalibrationStatus),
    Quantity("value", "values", P, "", "what was found, in the units of the numbers"),
    Quantity(
        "covariance",
        "covariance",
        (*P, "other_parameter"),
        "",
        "covariance of the values",
        known=Known.SOMEWHERE,
        infinite=True,
    ),
    Quantity("chi_squared", "chi_squared", (), "1", "sum of squares of residuals in deviations", low=0.0),
    Quantity("degrees_of_freedom", "degrees_of_freedom", (), "", "what chi_squared is compared with", values=int),
    Quantity("iterations", "iterations", (), "", "iterations of the least squares", values=int),
    Quantity("row", "rows", N, "", "rows of the log that were used", values=int),
    Quantity("position", "poses.position", (*N, "axis"), "m", "where the platform stood"),
    Quantity("quaternion", "poses.quaternion", (*N, "quaternion_part"), "1", "rotation from platform to world"),
    Quantity("unstrained_length", "unstrained_length", (*N, "cable"), "m", "true lengths of the cables", low=0.0),
    Quantity(
        "residual",
        "residuals",
        (*N, "reading"),
        "",
        "readings less predictions: lengths [m], load cells [N], position [m], rotation [rad]",
        known=Known.SOMEWHERE,
    ),
    Quantity("chi_squared_of_pose", "chi_squared_of_pose", N, "1", "share of each pose in chi_squared", low=0.0),
    Quantity("weight", "weights", N, "1", "less than 1 for a pose that does not fit the rest", low=0.0),
)
SENSORS: Final = {  # name in the file -> attribute, unit; each of one number, or one a cable or axis
    "length_deviation": ("cable", "m"),
    "tension_deviation": ("cable", "N"),
    "position_deviation": ("axis", "m"),
    "rotation_deviation": ("axis", "rad"),
}
PLACED: Final = (
    Quantity("measuring_position", "frame.position", ("axis",), "m", "where the measuring system stands"),
    Quantity("measuring_quaternion", "frame.quaternion", ("quaternion_part",), "1", "its rotation to the world"),
    Quantity("target", "target", ("axis",), "m", "the measured point of the platform"),
)
LEFT_OUT: Final = (
    Quantity("left_out_row", "", ("omission",), "", "rows of the log that were left out", values=int),
    Quantity("left_out_reason", "", ("omission",), "", "why", codes=Omission),
)
OUTLIERS: Final = (
    Quantity("outlier_row", "row", ("outlier",), "", "row of the log", values=int),
    Quantity("outlier_cable", "cable", ("outlier",), "", "its cable, -1 for the whole pose", values=int),
    Quantity("outlier_quantity", "quantity", ("outlier",), "", "what does not fit", values=str),
    Quantity("outlier_size", "size", ("outlier",), "", "by how much [m, N or rad]"),
    Quantity("outlier_deviations", "deviations", ("outlier",), "1", "the same in standard deviations"),
)
CROSS_VALIDATION: Final = (
    Quantity("folds", "folds", (), "", "parts of the poses that were predicted from the others", values=int),
    *(
        Quantity(f"left_out_{name}", name, (), unit, f"root mean square {what}", known=Known.SOMEWHERE, low=0.0)
        for name, unit, what in (
            ("tension", "N", "of load cells at poses left out"),
            ("position", "m", "of positions at poses left out"),
            ("tension_before", "N", "of load cells with the robot as it was"),
            ("position_before", "m", "of positions with the robot as it was"),
        )
    ),
)


def directions(group: str) -> tuple[Quantity, ...]:
    """Variables of the directions that data leave open, or hardly tell.

    Args:
        group: "gauge" or "cannot_tell_apart".
    """
    return (
        Quantity(f"{group}_name", "name", (group,), "", "what each is", values=str),
        Quantity(f"{group}_vector", "vector", (group, *P), "", "combination of the numbers, in their units"),
        Quantity(f"{group}_known", "known", (group,), "1", "share of its prior deviation that is left", low=0.0),
        Quantity(f"{group}_step", "step", (group,), "", "what to do about it", values=str),
    )


DIRECTIONS: Final = {group: directions(group) for group in ("gauge", "cannot_tell_apart")}
