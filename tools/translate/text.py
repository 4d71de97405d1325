"""C text at the beginning of every translation: sizes of arrays, elements, and operators with Python's meaning."""

from __future__ import annotations

from typing import Final

from tools.translate.types import Element

_MATH: Final = (  # functions of one or two floats that C99 has under the same name as math or NumPy
    "acos acosh asin asinh atan atan2 atanh cbrt copysign cos cosh erf erfc exp expm1 hypot log log10 log1p log2 sin "
    "sinh sqrt tan tanh"
)
MATH: Final = tuple(_MATH.split(" "))
_WORDS: Final = (  # functions of C99, and other functions that the text uses
    "auto break case char const continue default do double else enum extern float for goto if inline int long register "
    "restrict return short signed sizeof static struct switch typedef union unsigned void volatile while bool true "
    "false complex I NAN INFINITY sl_code ceil creal cimag fabs floor fmod isfinite isinf isnan llabs pow rint"
)
RESERVED: Final = frozenset((*_WORDS.split(" "), *MATH))  # names that variables must not have
RANKS: Final = 5

_HEAD: Final = """\
/* Kernels of sagline in C99, written by tools/translate. Do not edit: change the Python source and translate again.

   Compile: -std=c99 -O2 -fno-math-errno -fno-trapping-math -ffp-contract=off, and -mno-fma where gcc may use it.
   With -DSL_CHECK every index is tested, and one outside its array ends the program with a message.
   An entry returns 0, or SAGLINE_SHORT_MEMORY if a work array is too small for the sizes of the others. */

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>

#define SAGLINE_SHORT_MEMORY 1

#if defined __GNUC__ && defined __OPTIMIZE_SIZE__
#define SL_FORMULA inline __attribute__((unused))
#elif defined __GNUC__
#define SL_FORMULA inline __attribute__((always_inline, unused))
#endif
#ifdef __GNUC__
#define SL_INLINE inline __attribute__((unused))
#define SL_HELPER static inline __attribute__((unused))
#else
#define SL_FORMULA inline
#define SL_INLINE inline
#define SL_HELPER static inline
#endif

/* the passes of the next loop have no effect on each other */
#if defined __clang__
#pragma clang diagnostic ignored "-Wpass-failed" /* some loops cannot be vectorized */
#define SL_INDEPENDENT _Pragma("clang loop vectorize(assume_safety)")
#elif defined __GNUC__
#define SL_INDEPENDENT _Pragma("GCC ivdep")
#else
#define SL_INDEPENDENT
#endif

#ifdef SL_CHECK
#include <stdio.h>
SL_HELPER int64_t sl_checked(int64_t index, int64_t size, const char *function, int line) {
    if (index < 0 || index >= size) {
        fprintf(stderr, "%s, line %d: index %lld of %lld\\n", function, line, (long long)index, (long long)size);
        abort();
    }
    return index;
}
#define SL_INDEX(index, size) sl_checked(index, size, __func__, __LINE__)
#else
#define SL_INDEX(index, size) (index)
#endif
"""

_HELPERS: Final = """
/* Bounds of slices count from the end if they are negative, and are clamped. */
SL_HELPER int64_t sl_bound(int64_t bound, int64_t size) {
    int64_t found = bound < 0 ? bound + size : bound;
    return found < 0 ? 0 : found > size ? size : found;
}
SL_HELPER int64_t sl_count(int64_t start, int64_t end) { return end > start ? end - start : 0; }

/* min and max of Python: the first number, unless the second is smaller or larger; NaN is neither. */
SL_HELPER double sl_min(double a, double b) { return b < a ? b : a; }
SL_HELPER double sl_max(double a, double b) { return b > a ? b : a; }
SL_HELPER int64_t sl_min_int(int64_t a, int64_t b) { return b < a ? b : a; }
SL_HELPER int64_t sl_max_int(int64_t a, int64_t b) { return b > a ? b : a; }

/* Division rounds down, and the remainder has the sign of the divisor. By the integer 0: 0, as compiled by numba. */
SL_HELPER int64_t sl_floor_divide(int64_t a, int64_t b) {
    if (b == 0) return 0;
    if (b == -1) return (int64_t)(0 - (uint64_t)a);
    return a / b - (a % b != 0 && (a < 0) != (b < 0));
}
SL_HELPER int64_t sl_modulo(int64_t a, int64_t b) {
    if (b == 0 || b == -1) return 0;
    int64_t rest = a % b;
    return rest != 0 && (rest < 0) != (b < 0) ? rest + b : rest;
}
SL_HELPER double sl_modulo_float(double a, double b) {
    double rest = fmod(a, b);
    if (rest == 0.0) return copysign(0.0, b);
    return (rest < 0.0) != (b < 0.0) ? rest + b : rest;
}
SL_HELPER double sl_floor_divide_float(double a, double b) {
    if (b == 0.0) return a / b;
    double rest = fmod(a, b), quotient = (a - rest) / b;
    if (rest != 0.0 && (rest < 0.0) != (b < 0.0)) quotient -= 1.0;
    if (quotient == 0.0) return copysign(0.0, a / b);
    double found = floor(quotient);
    return quotient - found > 0.5 ? found + 1.0 : found;
}

/* Whole powers by squaring. */
SL_HELPER double sl_square(double base) { return base * base; }
SL_HELPER double sl_power(double base, int64_t exponent) {
    double found = 1.0;
    for (int64_t left = llabs(exponent); left > 0; left >>= 1, base *= base) {
        if (left & 1) found *= base;
    }
    return exponent < 0 ? 1.0 / found : found;
}
SL_HELPER int64_t sl_power_int(int64_t base, int64_t exponent) {
    uint64_t found = 1, square = (uint64_t)base;
    for (; exponent > 0; exponent >>= 1, square *= square) {
        if (exponent & 1) found *= square;
    }
    return (int64_t)found;
}

/* Complex numbers as in Python: no rules for infinities, division by the larger part. */
#include <complex.h>
SL_HELPER double _Complex sl_complex(double real, double imaginary) {
    double _Complex number;
    ((double *)&number)[0] = real;
    ((double *)&number)[1] = imaginary;
    return number;
}
SL_HELPER double _Complex sl_multiply(double _Complex a, double _Complex b) {
    return sl_complex(creal(a) * creal(b) - cimag(a) * cimag(b), creal(a) * cimag(b) + cimag(a) * creal(b));
}
SL_HELPER double _Complex sl_divide(double _Complex a, double _Complex b) {
    if (fabs(creal(b)) >= fabs(cimag(b))) {
        if (creal(b) == 0.0) return sl_complex(NAN, NAN);
        double ratio = cimag(b) / creal(b), whole = creal(b) + cimag(b) * ratio;
        return sl_complex((creal(a) + cimag(a) * ratio) / whole, (cimag(a) - creal(a) * ratio) / whole);
    }
    if (cimag(b) == 0.0) return sl_complex(NAN, NAN);
    double ratio = creal(b) / cimag(b), whole = creal(b) * ratio + cimag(b);
    return sl_complex((creal(a) * ratio + cimag(a)) / whole, (cimag(a) * ratio - creal(a)) / whole);
}
SL_HELPER double sl_absolute(double _Complex a) { return hypot(creal(a), cimag(a)); }
"""


def _elements() -> str:
    """Macros for an element of an array by its indices: AT for contiguous arrays, VIEW for arrays with strides."""
    lines = ["", "/* Elements of contiguous arrays, and of views with strides. */"]
    for rank in range(1, RANKS):
        names = [f"i{axis}" for axis in range(rank)]
        checked = [f"SL_INDEX({name}, (a).n{axis})" for axis, name in enumerate(names)]
        place = checked[0]
        for axis in range(1, rank):
            place = f"({place}) * (a).n{axis} + {checked[axis]}"
        strided = " + ".join(f"{each} * (a).s{axis}" for axis, each in enumerate(checked))
        lines.append(f"#define AT{rank}(a, {', '.join(names)}) (a).p[{place}]")
        lines.append(f"#define VIEW{rank}(a, {', '.join(names)}) (a).p[{strided}]")
    return "\n".join(lines) + "\n"


HELPERS: Final = _elements() + _HELPERS
HEAD: Final = _HEAD + HELPERS


def array_name(element: Element, rank: int, strided: bool, constant: bool) -> str:
    """Name of the struct of an array type."""
    return f"{element.value[2]}{rank}{'Constant' * constant}{'View' * strided}"
