"""Folders of sweeps: a Zarr group with the request, and with one chunk per variable and task."""

# The folder contains the whole request. A computer with access to the folder therefore needs only the number of a task
# to compute the task. The checksum of a chunk shows whether the chunk is complete.

from __future__ import annotations

import errno
import hashlib
import json
import math
import os
from collections.abc import Mapping
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from sagline.cables.models import models_by_name
from sagline.core.arrays import locked
from sagline.core.errors import FileError, InvalidValueError
from sagline.files.netcdf import Format, choice_attributes, choice_of
from sagline.files.robot_file import dump_robot, parse_robot
from sagline.files.variables import Quantity
from sagline.files.writing import staging
from sagline.robot.pose import Pose
from sagline.sweep.request import Request, RequestBox, variables_of
from sagline.tension.methods import methods_by_name
from sagline.workspaces.wrench_sets import WrenchSet

if TYPE_CHECKING:
    from zarr import Group

FORMAT: Final = Format(
    kind=Request,
    name="sweep",
    made="folder of sagline sweep",
    give="Give a folder that sagline sweep has written.",
    again="Sweep again, into another folder.",
    key="sagline_sweep_format",
)
DIMENSIONS: Final = ("robot", "pose", "wrench")
GROUP: Final = "numbers.zarr"  # name of the request in the folder
UNASKED: Final = -1  # status of a request that is not computed yet
GIVEN: Final = {  # dimensions and unit of each array in the request
    "position": ("pose", "axis", "m"),
    "quaternion": ("pose", "quaternion_part", "1"),
    "wrench": ("wrench", "wrench_part", "N, N m"),
}
SHAPES: Final = {  # dimensions of each array in a set of loads
    "center": (6,),
    "segments": (-1, 6),
    "ellipsoids": (-1, 6, 6),
    "corners": (-1, 6),
    "sizes": (-1,),
    "accelerations": (2,),
}
STEP: Final = "Free some space or correct the permissions, and run the same sweep again to continue."


class SweepFolder:
    """Open folder of a sweep."""

    def __init__(self, path: Path) -> None:
        """Open the folder of a sweep and read the request; raises FileError for a missing or damaged sweep."""
        import zarr

        self.path = path
        check_package("zarr", "sweeps")
        if not path.is_dir():
            raise FileError(path, "is not a folder", FORMAT.give)
        try:
            self.group: Group = zarr.open_group(path / GROUP, mode="r+", zarr_format=3)
            attributes: dict[str, Any] = dict(self.group.attrs)
            given: dict[str, Any] = {name: self.group[name] for name in GIVEN}
        except (OSError, ValueError, KeyError, TypeError):
            raise FileError(path, "is not a folder of a sweep", FORMAT.give) from None
        FORMAT.check(path, attributes)
        try:
            texts = list(attributes["robots"])
            self.request = Request(
                [parse_robot(text, f"{path}, robot {k}") for k, text in enumerate(texts)],
                Pose.from_quaternion(given["position"][:], given["quaternion"][:]),
                given["wrench"][:],
                attributes["quantities"],
                model=choice_of(path, attributes, "model", models_by_name()),
                tension=choice_of(path, attributes, "tension", methods_by_name()),
                around=_set_of(attributes["around"]),
                moment_arm=attributes["moment_arm"],
            )
            # numbers of poses and wrenches in a task; a task has one robot
            self.size = int(attributes["task_poses"]), int(attributes["task_wrenches"])
            # made_by: version of sagline that created the folder
            self.made_by, self.digest = str(attributes["source"]), str(attributes["digest"])
        except (KeyError, ValueError, TypeError, RuntimeError, OSError) as error:
            if isinstance(error, InvalidValueError):
                raise FileError.of(path, error) from None
            raise FileError(path, f"is damaged ({type(error).__name__}: {error})", FORMAT.again) from None
        if self.digest != request_digest(self.request) or min(self.size) < 1:
            raise FileError(path, "has changed since its creation, because its digest differs", FORMAT.again)

    @property
    def grid(self) -> tuple[int, int, int]:
        """Numbers of tasks along the three axes: robots, poses and wrenches."""
        robots, poses, wrenches = self.request.shape
        return robots, math.ceil(poses / self.size[0]), math.ceil(wrenches / self.size[1])

    @property
    def tasks(self) -> int:
        """Number of tasks."""
        return math.prod(self.grid)

    def part(self, number: int) -> RequestBox:
        """Box of requests that the task `number` computes."""
        _, poses, wrenches = self.request.shape
        robot, row, column = (int(k) for k in np.unravel_index(number, self.grid))
        tall, wide = self.size
        rows = slice(row * tall, min((row + 1) * tall, poses))
        return RequestBox(robot, rows, slice(column * wide, min((column + 1) * wide, wrenches)))

    def write(self, number: int, numbers: Mapping[str, NDArray[np.generic]]) -> None:
        """Write the chunks of a task, each atomically; raises FileError if a chunk cannot be written."""
        robot, rows, columns = self.part(number)
        try:
            for name, values in numbers.items():
                array: Any = self.group[name]
                # Zarr would otherwise not write chunks of fill values
                array.with_config({"write_empty_chunks": True})[robot, rows, columns] = values
        except OSError as error:
            raise FileError(self.path, f"cannot be written ({error.strerror or error})", STEP) from None

    def read(self, number: int) -> dict[str, NDArray[np.generic]] | None:
        """Results of a task from its chunks; None if a chunk is missing or damaged."""
        robot, rows, columns = self.part(number)
        numbers = {}
        for variable in variables_of(self.request.quantities):
            array: Any = self.group[variable.name]
            # file of the chunk, with the name that Zarr uses
            place = [*np.unravel_index(number, self.grid), *[0] * len(variable.parts)]
            if not self.path.joinpath(GROUP, variable.name, "c", *map(str, place)).is_file():
                return None
            try:
                numbers[variable.name] = np.asarray(array[robot, rows, columns])
            except (ValueError, RuntimeError, OSError):  # errors of checksum, decompression and disk
                return None
        return numbers


def make_folder(path: Path, request: Request, size: tuple[int, int]) -> None:
    """Create the folder of a sweep atomically; raises an error if the request cannot be written."""
    check_package("zarr", "sweeps")
    texts = [dump_robot(robot) for robot in request.robots]
    options = _options(request)
    attributes = {
        **FORMAT.attributes(f"Sweep of {len(request):,} requests"),
        "digest": _digest(texts, options, request),
        "task_poses": size[0],
        "task_wrenches": size[1],
        "robots": texts,
        **options,
    }
    try:
        with staging(path.absolute().parent) as place:
            _fill(place / path.name / GROUP, request, size, attributes)
            os.replace(place / path.name, path)
    except OSError as error:
        if error.errno in (errno.ENOTEMPTY, errno.EEXIST):
            return  # another process has created the folder, which is checked when it is opened
        reason = f"cannot be created ({error.strerror or error})"
        raise FileError(path, reason, "Check its name, the permissions and the space on the disk.") from None


def request_digest(request: Request) -> str:
    """Digest of a request. Requests with equal robots, poses, wrenches, quantities and methods have equal digests."""
    return _digest([dump_robot(robot) for robot in request.robots], _options(request), request)


def check_made_here(folder: SweepFolder) -> None:
    """Raise FileError if another version of sagline, which may give other numbers, created the folder."""
    here = f"sagline {version('sagline')}"
    if folder.made_by != here:
        step = f"Finish the sweep with {folder.made_by}, or sweep into another folder."
        raise FileError(folder.path, f"was begun with {folder.made_by}, and this is {here}", step)


def is_installed(package: str) -> bool:
    """True if an optional package is installed."""
    return find_spec(package) is not None


def check_package(name: str, purpose: str) -> None:
    """Raise InvalidValueError with an installation command if the optional package `name` is missing."""
    if not is_installed(name):
        step = 'Install it: pip install "sagline[sweep]".'
        raise InvalidValueError(f"the package {name}", "not installed", f"installed, for {purpose}", step)


def _options(request: Request) -> dict[str, Any]:
    """Dictionary of a request's values for JSON, without robots and arrays."""
    options = {
        "quantities": list(request.quantities),
        **choice_attributes("model", request.model, models_by_name()),
        **choice_attributes("tension", request.tension, methods_by_name()),
        "around": {name: getattr(request.around, name).tolist() for name in SHAPES},
        "moment_arm": request.moment_arm,
    }
    return {key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in options.items()}


def _set_of(written: Mapping[str, Any]) -> WrenchSet:
    """Wrench set from a dictionary that `_options` has created."""
    kinds = {name: np.int64 if name == "sizes" else np.float64 for name in SHAPES}
    return WrenchSet(*(locked(np.array(written[name], kinds[name]).reshape(SHAPES[name])) for name in SHAPES))


def _digest(texts: list[str], options: Mapping[str, Any], request: Request) -> str:
    found = hashlib.sha256(json.dumps([texts, options], sort_keys=True).encode())
    for array in _arrays(request).values():
        found.update(str(array.shape).encode() + np.ascontiguousarray(array).tobytes())
    return found.hexdigest()


def _arrays(request: Request) -> dict[str, NDArray[np.float64]]:
    """Arrays of a request, in the order of `GIVEN`."""
    return dict(zip(GIVEN, (request.poses.position, request.poses.quaternion, request.wrenches), strict=True))


def _fill(place: Path, request: Request, size: tuple[int, int], attributes: dict[str, Any]) -> None:
    import zarr
    from zarr.codecs import Crc32cCodec, ZstdCodec

    group = zarr.create_group(place, zarr_format=3, attributes=attributes)
    codecs = [ZstdCodec(level=1), Crc32cCodec()]
    for name, values in _arrays(request).items():
        along, part, unit = GIVEN[name]
        group.create_array(
            name,
            data=np.ascontiguousarray(values),
            chunks=values.shape,
            compressors=codecs,
            dimension_names=(along, part),
            attributes={"units": unit},
        )
    for variable in variables_of(request.quantities):
        cables = (request.cable_count,) * len(variable.parts)
        group.create_array(
            variable.name,
            shape=(*request.shape, *cables),
            dtype=variable.type.name,
            chunks=(1, *size, *cables),
            compressors=codecs,
            fill_value=unknown_value(variable),
            dimension_names=(*DIMENSIONS, *variable.parts),
            attributes=_attributes(variable),
        )


def _attributes(variable: Quantity) -> dict[str, Any]:
    """Attributes of a variable by the CF conventions, with a status for requests that are not computed yet."""
    found = variable.attributes
    if variable.codes is not None:
        found["flag_values"] = [UNASKED, *found["flag_values"].tolist()]
        found["flag_meanings"] = f"unasked {found['flag_meanings']}"
    return found


def unknown_value(variable: Quantity) -> float:
    """Fill value of a variable: the value for requests that are not computed yet."""
    return UNASKED if variable.type == np.int8 else math.nan
