"""Modules for LinuxCNC, compiled with its real headers and loaded with a stand-in for its HAL."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from tests.files.c_programs import compiler

ROOT: Final = Path(__file__).parents[1]
PLACES: Final = (Path("/usr/include/linuxcnc"), ROOT / "build/linuxcnc/usr/include/linuxcnc")
FLAGS: Final = ("-Os", "-I.", "-DRTAPI", "-D_GNU_SOURCE", "-Drealtime", "-D__MODULE__")  # of Makefile.modinc
FORMATS: Final = {"mm": 1e3, "inch": 1.0 / 0.0254, "m": 1.0}
HAL: Final = r"""
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "rtapi.h"
#include "hal.h"
static struct { char name[48]; int kind; void *value; } pins[64];
static int count, refused = -1, left;
static int add(int kind, void **place, const char *format, va_list rest) {
    if (count == refused) return -12;
    vsnprintf(pins[count].name, sizeof pins[count].name, format, rest);
    pins[count].kind = kind;
    *place = pins[count++].value = calloc(1, 8);
    return 0;
}
#define NEW(type, number) \
int hal_pin_##type##_newf(hal_pin_dir_t dir, hal_##type##_t **place, int id, const char *format, ...) { \
    va_list rest; (void)id; va_start(rest, format); \
    int failed = add(number + (dir == HAL_OUT), (void **)place, format, rest); va_end(rest); return failed; }
NEW(float, 0) NEW(s32, 2)
int hal_init(const char *name) { (void)name; count = 0; return 7; }
int hal_exit(int id) { left = id; return 0; }
int hal_ready(int id) { return id == 7 ? 0 : -1; }
void *hal_malloc(long size) { return calloc(1, size); }
void refuse(int place) { refused = place; }
int was_left(void) { return left; }
void *pin(const char *name, int kind) {
    for (int k = 0; k < count; k++)
        if (strcmp(pins[k].name, name) == 0 && pins[k].kind == kind) return pins[k].value;
    return NULL;
}
"""


def headers() -> Path:
    """Folder of the headers of LinuxCNC; a machine without them fails, because no other test compiles the module."""
    found = [place for place in PLACES if (place / "kinematics.h").is_file()]
    if not found:
        pytest.fail("the headers of LinuxCNC are missing: run make linuxcnc-headers", pytrace=False)
    return found[0]


class World(ctypes.Structure):
    """`EmcPose`: X, Y, Z in machine units, A, B, C in degrees, and three unused axes."""

    _fields_ = [(name, ctypes.c_double) for name in "xyzabcuvw"]


class Module:
    """Module of a robot with pins."""

    def __init__(self, robot: sl.Robot, folder: Path, *, refuse: int = -1, **asked: Any) -> None:
        source, self.settings = sl.export_linuxcnc(robot, folder, **asked)
        (folder / "hal.c").write_text(HAL)
        strict = ("-Wall", "-Wextra", "-Werror", "-shared", "-fPIC", "-isystem", str(headers()))
        words = [
            compiler(),
            *FLAGS,
            *strict,
            str(source),
            str(folder / "hal.c"),
            "-o",
            str(folder / "module.so"),
            "-lm",
        ]
        done = subprocess.run(words, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        self.library = ctypes.CDLL(str(folder / "module.so"))
        self.library.pin.restype = ctypes.c_void_p
        self.name, self.cables = source.stem, robot.cable_count
        self.units = FORMATS[asked.get("unit", "mm")]
        self.library.refuse(refuse)
        self.started = self.library.rtapi_app_main()

    def pin(self, name: str, *, output: bool = True, number: Any = ctypes.c_double) -> Any:
        """A pin by its name without that of the module."""
        kind = (0 if number is ctypes.c_double else 2) + output
        place = self.library.pin(f"{self.name}.{name}".encode(), kind)
        assert place is not None, name
        return number.from_address(place)

    def push(self, wrench: Array) -> None:
        """Set the pins of the wrench (6,)."""
        for k, value in enumerate(wrench):
            self.pin(f"{'force' if k < 3 else 'moment'}-{'xyz'[k % 3]}", output=False).value = value

    @property
    def status(self) -> int:
        """Status of the last call."""
        return int(self.pin("status", number=ctypes.c_int32).value)

    def inverse(self, position: Array, angles: Array) -> tuple[int, Array, Array]:
        """Result, lengths [m] and tensions [N] at a position [m] with angles A, B, C [rad]."""
        world, joints = World(*(self.units * position), *np.rad2deg(angles)), np.full(self.cables, np.nan)
        code = self.library.kinematicsInverse(ctypes.byref(world), joints.ctypes, None, None)
        tensions = np.array([self.pin(f"tension-{i}").value for i in range(self.cables)])
        return code, joints / self.units, tensions

    def forward(self, lengths: Array, world: World) -> tuple[int, Array, Array]:
        """Result, position [m] and angles A, B, C [degrees] from lengths [m]; `world` is the start, and is replaced."""
        joints = np.ascontiguousarray(self.units * lengths)
        code = self.library.kinematicsForward(joints.ctypes, ctypes.byref(world), None, None)
        position = np.array([world.x, world.y, world.z]) / self.units
        return code, position, np.array([world.a, world.b, world.c])
