"""Maps of frequencies in NetCDF: every number with its unit, and the robot inside."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from sagline.dynamics.vibration.frequency_map import FrequencyMap
from sagline.dynamics.vibration.vibration import VibrationStatus
from sagline.files.format import Format
from sagline.files.netcdf import attributes_with_units, labeled_dataset
from sagline.files.robot_file import dump_robot
from sagline.files.variables import SOMEWHERE, Quantity, variables_of_result

if TYPE_CHECKING:
    from xarray import Dataset

QUANTITIES: Final = (
    Quantity("position", ("axis",), "m", "position of the platform origin in the world", "pose.position"),
    Quantity("quaternion", ("quaternion_part",), "1", "rotation from platform to world", "pose.quaternion"),
    Quantity("status", (), "", "whether the state has linear vibrations", codes=VibrationStatus),
    Quantity("frequency", (), "Hz", "lowest frequency with cable mass", known=SOMEWHERE),
    Quantity("massless_frequency", (), "Hz", "lowest frequency, massless cables"),
    Quantity("platform_share", (), "1", "platform's share of the lowest mode with cable mass"),
    Quantity("peak", (), "m/N", "largest response to a force, with cable mass"),
    Quantity("peak_frequency", (), "Hz", "frequency of the largest response"),
)


def _pack(found: FrequencyMap) -> Dataset:
    """Create the data set of a frequency map."""
    variables = variables_of_result(found, QUANTITIES, ("pose",))
    attributes = {
        **FORMAT.attributes(f"Frequencies of {found.robot.name} over poses"),
        **attributes_with_units(found, {"up_to": "Hz"}),
        **attributes_with_units(found.damping, {"loss_time": "s", "air_damping": "N s/m2", "modal_damping": None}),
        "robot": dump_robot(found.robot),
    }
    return labeled_dataset(variables, attributes)


FORMAT: Final = Format(
    kind=FrequencyMap,
    name="map of frequencies",
    made="map of sagline",
    give="Give a .nc file that the save method of a map wrote.",
    again="Make the map again, or get the original file.",
    key="sagline_frequency_map_format",
    version=1,
    pack=_pack,
)
save = FORMAT.save
