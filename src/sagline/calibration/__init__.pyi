"""Public names of `sagline.calibration`."""

from .calibrate import calibrate as calibrate
from .findings import CalibrationStatus as CalibrationStatus
from .findings import Omission as Omission
from .log import Sensors as Sensors
from .log import WinchLog as WinchLog
from .parameters import Unknown as Unknown
from .planning import CalibrationPoses as CalibrationPoses
from .planning import calibration_poses as calibration_poses
from .result import Calibration as Calibration
from .result import PoseError as PoseError
