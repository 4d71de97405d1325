"""The C99 of `sagline export-c`: times on one core of this machine, and sizes for ARM microcontrollers."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from rich.console import Console

import sagline as sl
from benchmarks.measure import Row, one_core, show
from sagline.tension.methods import methods_by_name
from tests.files.c_programs import arm_sizes, compiled

# best of many runs over 256 poses; forward from 1 cm away
PROGRAM = """\
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <time.h>
#include "sagline.h"

enum { COUNT = 256, RUNS = 100 };
static sagline_work work;
static sagline_real sum;

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

int main(void)
{
    sagline_real pose[7] = {0, 0, 0, 0, 0, 0, 1}, length[COUNT][SAGLINE_CABLES], tension[SAGLINE_CABLES];
    double best[3] = {1, 1, 1};
    for (int run = 0; run < 3 * RUNS; run++) {
        double start = seconds();
        for (int i = 0; i < COUNT; i++) {
            pose[0] = (sagline_real)(0.2 + 1e-3 * i + (run % 3 ? 0.01 : 0));
            pose[1] = (sagline_real)-0.4;
            pose[2] = (sagline_real)1.4;
            pose[3] = pose[4] = pose[5] = 0;
            pose[6] = 1;
            if (run % 3 == 0)
                sum += sagline_inverse(&work, 0, pose, 0, 0, length[i], tension);
            else if (run % 3 == 1)
                sum += sagline_forward(&work, length[i], 0, pose, tension);
            else
                sum += sagline_search(&work, length[i], 0, pose, tension);
        }
        double took = (seconds() - start) / COUNT;
        best[run % 3] = took < best[run % 3] ? took : best[run % 3];
    }
    printf("%.1f %.1f %.1f\\n", 1e6 * best[0], 1e6 * best[1], 1e6 * best[2]);
    return sum != 0;
}
"""
EVERY: Final = [make() for make in methods_by_name().values()]
CASES: Final[tuple[tuple[str, str, dict[str, Any]], ...]] = (
    ("inverse", "article-prototype", {}),
    ("inverse, forward", "article-prototype", {"forward": True}),
    ("inverse, forward over pulleys", "ipanema-3-pulleys", {"forward": True}),
    ("the same, all methods", "ipanema-3-pulleys", {"forward": True, "tension": EVERY}),
)


def times() -> Iterator[Row]:
    """Times of a pose and of a sample."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "bench.c").write_text(PROGRAM)
        for single in (False, True):
            robot = sl.load_robot("article-prototype")
            source, _, _ = sl.export_c(robot, folder / "sagline.c", forward=True, single_precision=single)
            made = compiled(folder / "bench.c", folder / "bench", "-O2", str(source))
            numbers = subprocess.run([made], check=True, capture_output=True, text=True).stdout.split()
            kind = "float" if single else "double"
            yield Row(f"C, {kind}: inverse, forward, search", "", f"{', '.join(numbers)} us")


def sizes() -> Iterator[Row]:
    """Sizes for microcontrollers."""
    if shutil.which("arm-none-eabi-gcc") is None:
        yield Row("C on ARM", "", "not measured: arm-none-eabi-gcc is not installed")
        return
    with TemporaryDirectory() as name:
        for what, preset, asked in CASES:
            for core, single in (("Cortex-M4F", True), ("Cortex-M7", False)):
                robot, file = sl.load_robot(preset), Path(name) / "sagline.c"
                source, _, _ = sl.export_c(robot, file, single_precision=single, **asked)
                found = arm_sizes(source, core)
                kind = "float" if single else "double"
                work = arm_sizes(_work_of(source), core).variables
                numbers = (found.code + found.constants, work, found.stack)
                yield Row(f"{core}, {kind}: {what}", "", " ".join(f"{number / 1000:.1f}" for number in numbers) + " kB")


def _work_of(source: Path) -> Path:
    """A source that contains only the work memory."""
    file = source.with_name("work.c")
    file.write_text('#include "sagline.h"\nextern sagline_work work;\nsagline_work work;\n')
    return file


PARTS = (times, sizes)

if __name__ == "__main__":
    one_core()
    title = "C99 for a microcontroller; on ARM: code and constants, work memory, stack"
    show(title, [row for part in PARTS for row in part()], Console())
