"""C source of a robot with sanitizers, the analyzer and a compiler for microcontrollers; the program on its page."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.tension import methods as tension_methods
from tests.files.c_programs import CORES, Program, arm_sizes, compiled
from tests.tiers import extended

pytestmark = extended

PAGE = Path(__file__).parents[2] / "docs" / "howto" / "microcontroller.md"
EVERY = [make() for make in tension_methods.methods_by_name().values()]
# all methods at feasible and infeasible poses, then forward with and without an initial pose
MAIN = """\
#include <stdio.h>
#include "sagline.h"

int main(void)
{
    static sagline_work work;
    sagline_real pose[7] = {0, 0, 0, 0, 0, 0, 1}, length[SAGLINE_CABLES], tension[SAGLINE_CABLES];
    sagline_real previous[SAGLINE_CABLES], load[6] = {3, -2, 5, 1, -1, (sagline_real)0.5};
    int solved = 0;
    for (int method = 0; method < SAGLINE_METHODS; method++)
        for (int k = 0; k < 60; k++) {
            pose[0] = (sagline_real)(0.9 * (k % 5 - 2));
            pose[1] = (sagline_real)(0.8 * (k / 5 % 4 - 1.5));
            pose[2] = (sagline_real)(0.4 + 1.1 * (k / 20));
            for (int i = 0; i < SAGLINE_CABLES; i++)
                previous[i] = 100;
            if (sagline_inverse(&work, method, pose, k % 2 ? load : 0, previous, length, tension) != SAGLINE_SOLVED)
                continue;
            solved++;
            sagline_real start[7] = {pose[0] + (sagline_real)0.01, pose[1], pose[2], 0, 0, 0, 1};
            solved += sagline_forward(&work, length, k % 2 ? load : 0, start, tension) == SAGLINE_SOLVED;
            solved += method == 0 && sagline_search(&work, length, 0, start, tension) == SAGLINE_SOLVED;
        }
    printf("%d\\n", solved);
    return 0;
}
"""


@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize("name", ["article-prototype", "ipanema-3-pulleys"])
def test_sanitizers_find_no_invalid_access_and_no_undefined_behavior(name: str, single: bool, tmp_path: Path) -> None:
    robot = sl.load_robot(name)
    source, _, _ = sl.export_c(robot, tmp_path / "sagline.c", tension=EVERY, forward=True, single_precision=single)
    (tmp_path / "main.c").write_text(MAIN)
    flags = ("-O1", "-g", "-DSL_CHECK", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
    words = (*flags, str(source))
    made = compiled(tmp_path / "main.c", tmp_path / "main", *words)
    done = subprocess.run([made], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert int(done.stdout) > 40 * len(EVERY)


def test_the_analyzer_finds_nothing(tmp_path: Path) -> None:
    source, _, _ = sl.export_c(sl.load_robot("ipanema-3-pulleys"), tmp_path / "sagline.c", forward=True)
    compiled(source, tmp_path / "sagline.o", "-O0", "-fanalyzer", "-c")


def test_single_precision_source_uses_no_double_precision(tmp_path: Path) -> None:
    """Sizes with arm-none-eabi-gcc if it is installed; otherwise the compiler of zig compiles the source."""
    robot = sl.load_robot("article-prototype")
    source, _, _ = sl.export_c(robot, tmp_path / "sagline.c", forward=True, single_precision=True)
    if shutil.which("arm-none-eabi-gcc") is None:
        zig = [sys.executable, "-m", "ziglang", "cc", "-target", "thumb-linux-musleabihf", "-mcpu=cortex_m7"]
        compiled(source, tmp_path / "sagline.o", "-Os", "-c", command=zig)
        return
    for core in CORES:
        sizes = arm_sizes(source, core, "-Os", "-Wdouble-promotion")
        assert sizes.code < 36_000
        assert sizes.constants < 2_000
        assert sizes.variables == 0  # no state variables
        assert sizes.stack < 8_000
    called = subprocess.run(["nm", "-u", str(tmp_path / "sagline.o")], check=True, capture_output=True, text=True)
    names = set(called.stdout.split()) - {"U"}
    assert not {name for name in names if name.startswith("__aeabi_d")}  # arithmetic in double precision
    assert {name for name in names if not name.endswith("f")} <= {"memcpy", "memmove", "memset"}


@pytest.mark.skipif(shutil.which("arm-none-eabi-gcc") is None, reason="its page names the compiler")
@pytest.mark.parametrize("single", [True, False])
@pytest.mark.parametrize(("functions", "asked"), [("inverse", {}), ("inverse, forward", {"forward": True})])
def test_the_sizes_on_the_page(functions: str, asked: dict[str, Any], single: bool, tmp_path: Path) -> None:
    core, kind = ("Cortex-M4F", "float") if single else ("Cortex-M7", "double")
    (stated,) = re.findall(rf"^\| {core}, `{kind}`: {functions} \| ([\d.]+) \|", PAGE.read_text(), re.MULTILINE)
    robot = sl.load_robot("article-prototype")
    source, _, _ = sl.export_c(robot, tmp_path / "sagline.c", single_precision=single, **asked)
    sizes = arm_sizes(source, core)
    assert (sizes.code + sizes.constants) / 1000.0 == pytest.approx(float(stated), rel=0.1)


def test_the_program_on_its_page_prints_the_output_on_the_page(tmp_path: Path) -> None:
    page = PAGE.read_text()
    (program,) = re.findall(r"```c\n(.*?)```", page, re.DOTALL)
    (tmp_path / "program.c").write_text(program)
    source, _, _ = sl.export_c(sl.load_robot("article-prototype"), tmp_path / "sagline.c", forward=True)
    made = compiled(tmp_path / "program.c", tmp_path / "program", str(source))
    printed = subprocess.run([made], check=True, capture_output=True, text=True).stdout.strip()
    assert printed in re.findall(r'```text title="output"\n(.*?)\n```', page, re.DOTALL)


def test_optimization_flags_change_no_digit(tmp_path: Path) -> None:
    """-O3 with AVX2, as for the compiled kernels: -mno-fma keeps the rounding of all operations."""
    robot = sl.load_robot("cogiro")
    poses = sl.Pose.from_euler(
        np.random.default_rng(1).uniform(-1.0, 1.0, (50, 3)) + np.array((0.0, 0.0, 2.0)), 0.1, 0.0, 0.05
    )
    plan = sl.inverse(robot, poses)
    found = Program(robot, tmp_path, "-O3", "-march=x86-64-v3", "-mno-fma").inverse(poses)
    assert plan.feasible.all()
    np.testing.assert_array_equal(found.found, plan.unstrained_length)
