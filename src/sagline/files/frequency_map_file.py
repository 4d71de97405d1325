"""Maps of frequencies in NetCDF: every number with its unit, and the robot inside."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from sagline.dynamics.frequency_map import FrequencyMap
from sagline.dynamics.vibration_status import VibrationStatus
from sagline.files.format import Format
from sagline.files.netcdf import labeled_dataset
from sagline.files.robot_file import dump_robot
from sagline.files.variables import Known, Quantity

if TYPE_CHECKING:
    from xarray import Dataset

ROWS: Final = "pose"
QUANTITIES: Final = (
    Quantity("position", "pose.position", ("axis",), "m", "position of the platform origin in the world"),
    Quantity("quaternion", "pose.quaternion", ("quaternion_part",), "1", "rotation from platform to world"),
    Quantity("status", "status", (), "", "whether the state has linear vibrations", codes=VibrationStatus),
    Quantity("frequency", "frequency", (), "Hz", "lowest frequency with cable mass", known=Known.SOMEWHERE),
    Quantity("massless_frequency", "massless_frequency", (), "Hz", "lowest frequency, massless cables"),
    Quantity("platform_share", "platform_share", (), "1", "platform's share of the lowest mode with cable mass"),
    Quantity("peak", "peak", (), "m/N", "strongest answer to a force, with cable mass"),
    Quantity("peak_frequency", "peak_frequency", (), "Hz", "where that is"),
)


def pack(found: FrequencyMap) -> Dataset:
    """Data set of a frequency map."""
    variables = {one.name: ((ROWS, *one.parts), one.of(found), one.attributes) for one in QUANTITIES}
    attributes = {
        **FORMAT.attributes(f"Frequencies of {found.robot.name} over poses"),
        "up_to": found.up_to,
        "up_to_units": "Hz",
        "loss_time": found.damping.loss_time,
        "loss_time_units": "s",
        "air_damping": found.damping.air_damping,
        "air_damping_units": "N s/m2",
        "modal_damping": found.damping.modal_damping,
        "robot": dump_robot(found.robot),
    }
    return labeled_dataset(variables, attributes)


FORMAT: Final = Format(
    kind=FrequencyMap,
    name="map of frequencies",
    made="map of sagline",
    give="Give the .nc file that a map's save wrote.",
    again="Make the map again, or take the file from where it came.",
    key="sagline_frequency_map_format",
    version=1,
    pack=pack,
)
save = FORMAT.save
