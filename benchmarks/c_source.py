"""The C99 of `sagline export-c`, compiled by the system's compiler with -O2; one core."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console

import sagline as sl
from benchmarks.measure import Row, one_core, show
from tests.files.c_programs import compiled

# best of many runs over 4096 cables of 0.5 to 5 m; strain of at most tau_max/EA
PROGRAM = """\
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <time.h>
#include "sagline.h"

enum { COUNT = 4096, RUNS = 300 };
static double span[COUNT], rise[COUNT], tau[COUNT], length[COUNT], sum;

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static double random_number(void)
{
    static unsigned long state = 1;
    state = (state * 6364136223846793005UL + 1442695040888963407UL) & 0xffffffffffffffffUL;
    return (double)(state >> 11) / 9007199254740992.0;
}

static void cables(double stiffness)
{
    double best[2] = {1.0, 1.0}, force[2], value;
    for (int run = 0; run < RUNS; run++) {
        double start = seconds();
        for (int i = 0; i < COUNT; i++) {
            sagline_length(span[i], rise[i], tau[i], 0.8829, stiffness, &length[i], &value);
            sum += value;
        }
        double middle = seconds();
        for (int i = 0; i < COUNT; i++) {
            sagline_tension(span[i], rise[i], length[i], 0.8829, stiffness, force, &value);
            sum += value;
        }
        double end = seconds();
        best[0] = middle - start < best[0] ? middle - start : best[0];
        best[1] = end - middle < best[1] ? end - middle : best[1];
    }
    printf("%.1f %.1f ", 1e9 * best[0] / COUNT, 1e9 * best[1] / COUNT);
}

int main(void)
{
    const double rotation[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    double position[3] = {0.2, -0.4, 1.4}, tension[SAGLINE_CABLES], best = 1.0;
    for (int i = 0; i < COUNT; i++) {
        span[i] = 0.5 + 4.0 * random_number();
        rise[i] = -2.5 + 2.0 * random_number();
        tau[i] = 25.0 + 675.0 * random_number();
    }
    cables(70e3);
    cables(14e3);
    for (int run = 0; run < RUNS; run++) {
        double start = seconds();
        for (int i = 0; i < 256; i++) {
            position[0] = 0.2 + 1e-4 * i;
            sum += sagline_inverse(position, rotation, 0, 0, tension, length);
        }
        double took = (seconds() - start) / 256;
        best = took < best ? took : best;
    }
    printf("%.2f\\n", 1e6 * best);
    return sum < 0.0;
}
"""


def c_source() -> Iterator[Row]:
    """Times per cable and per pose, and sizes."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        source, header, _ = sl.export_c(sl.load_robot("article-prototype"), folder / "sagline.c")
        (folder / "bench.c").write_text(PROGRAM.replace("sagline.h", header.name))
        made = compiled(folder / "bench.c", folder / "bench", str(source))
        numbers = subprocess.run([made], check=True, capture_output=True, text=True).stdout.split()
        object_file = compiled(source, folder / "sagline.o", "-c", "-fstack-usage")
        sizes = subprocess.run(["size", "-A", object_file], check=True, capture_output=True, text=True).stdout
        size = sum(int(found) for found in re.findall(r"^\.text\s+(\d+)", sizes, re.MULTILINE))
        stack = {
            line.split()[0].rpartition(":")[2]: int(line.split()[1])
            for line in object_file.with_suffix(".su").read_text().splitlines()
        }
    yield Row("sagline.c, -O2: P3, P2, strain to 1 %", "<= 150, <= 150 ns a cable", f"{numbers[0]}, {numbers[1]} ns")
    yield Row("the same, strain to 5 %", "", f"{numbers[2]}, {numbers[3]} ns")
    yield Row("sagline.c: a pose of eight cables, MinimumNorm", "", f"{numbers[4]} us")
    deepest = stack["sagline_inverse"] + max(stack["sagline_length"], stack.get("place", 0))
    yield Row("sagline.c: machine code; stack of a pose", "<= 8 kB", f"{size / 1024:.1f} kB; {deepest / 1024:.1f} kB")


PARTS = (c_source,)

if __name__ == "__main__":
    one_core()
    show("C99 for a microcontroller", [row for part in PARTS for row in part()], Console())
