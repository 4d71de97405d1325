/* sagline.c: elastic catenaries, and the pose of a robot with two redundant cables, for a microcontroller.
 *
 * Plain C99: no heap, no recursion, no state, every loop bounded, double or (SAGLINE_FLOAT) single precision.
 * The mathematics is that of sagline's page "The model" (P2, P3: its section 2; sharing of the load: section 5).
 * SI units, z up. Forces act on the cable at its platform end. The header says what is given, what is filled, and what
 * each status means. Nothing reads errno: with gcc, -fno-math-errno makes it a sixth smaller. */
#include <float.h>
#include <stdbool.h>
#include <stddef.h>
#include <tgmath.h>

#include "sagline.h"

typedef sagline_real real;
#define R(x) ((real)(x))
#define N SAGLINE_FREEDOMS
#define M SAGLINE_CABLES

#ifdef __FAST_MATH__
#error "P2 counts on differences as they are written: compile without -ffast-math"
#endif

#ifdef SAGLINE_FLOAT
#define EPSILON FLT_EPSILON
#define SPLIT R(4097)     /* 2^12 + 1: halves of a mantissa */
#define STILL R(1e-4)     /* relative step of P2 after which no other counts: Halley cubes what is left */
#define LIGHTEST R(1e-12) /* of wL/(2 EA): what a cable without weight weighs in P2 */
#define RANK R(2e-5)      /* a diagonal of the triangular factor below this share of its row: rank is lost */
#else
#define EPSILON DBL_EPSILON
#define SPLIT R(134217729) /* 2^27 + 1 */
#define STILL R(1e-6)
#define LIGHTEST R(1e-25)
#define RANK R(1e-9)
#endif

#define LARGEST R(1e12) /* [m^2] of a chord's square: what is longer, or no number, is bad input */
#define DEEPEST R(2)    /* of wD/(2 tau) in P3, of h in P2: deeper sag is refused */
#define STRAINED R(0.1) /* of tau/EA: so are cables that stretch by more */
#define TURNED R(1e-5)  /* what products of a rotation's rows may be off */

enum { CABLE_STEPS = 60, ROUNDS = 30 };

static real larger(real a, real b)
{
    return a > b ? a : b;
}

/* (sinh(h) - h)/h^3 for y = h^2 <= 4, in four chains that do not wait for each other; cosh follows from sinh */
static real sinh_excess(real y)
{
    const real q = y * y, r = q * q;
    const real a = R(1 / 6.) + r * (R(1 / 39916800.) + r * R(1 / 121645100408832000.));
    const real b = R(1 / 120.) + r * (R(1 / 6227020800.) + r * R(1 / 51090942171709440000.));
    const real c = R(1 / 5040.) + r * (R(1 / 1307674368000.) + r * R(1 / 25852016738884976640000.));
    const real d = R(1 / 362880.) + r * R(1 / 355687428096000.);
    return (a + y * b) + q * (c + y * d);
}

/* P3: the length that gives a chord tension. The unknown is more = L/D - 1; Newton's method on the root form
 * F = L/D - s sqrt(c2 + s2/run^2), in which every number is 1 and a small part that keeps its digits. */
int sagline_length(real span, real rise, real tension, real weight, real stiffness, real *length, real *vertical)
{
    const real d2 = span * span + rise * rise, chord = sqrt(d2), inverse = 1 / chord;
    if (!(span >= 0 && d2 > 0 && d2 <= LARGEST && tension >= 0 && weight >= 0 && stiffness > 0))
        return SAGLINE_BAD_INPUT;
    const real sine = rise * inverse, cosine = span * inverse, c2 = cosine * cosine, s2 = sine * sine;
    const real x = weight * chord / (2 * tension), x2 = x * x, strain = tension / stiffness;
    if (!(x <= DEEPEST))
        return SAGLINE_DEEP_SAG;
    if (!(strain <= STRAINED))
        return SAGLINE_OVERSTRAINED;
    const real start = x2 * sinh_excess(x2), wide = c2 * start * (2 + start), twice = 1 + sqrt(1 + wide);
    const real drawn = strain * (twice + wide); /* what does not stretch is longer by wide/twice */
    const int steps = strain <= R(0.01) ? 2 : 3;
    real more = (wide - drawn) / (twice + drawn), s, square, cosh_h, run;
    for (int k = 0; k <= steps; k++) {
        const real slack = -strain * (1 + more), taut = 1 + slack, y = x2 * taut * taut;
        s = slack + taut * y * sinh_excess(y); /* 1 + s = sinh(h)/x of h = x taut */
        square = x2 * (1 + s) * (1 + s);
        cosh_h = sqrt(1 + square);
        run = s - slack * cosh_h;
        if (k < steps) {
            const real leaning = c2 * run * (2 + run), across = sqrt(1 + leaning), far = (1 + run) * across;
            const real excess = (1 + across) * (more + run + more * run - s) - leaning * (1 + s);
            const real fall = s2 * (1 + more) * strain * strain * square;
            more -= far * excess / ((1 + across) * (far * (1 + run + strain * cosh_h * across) - fall));
        }
    }
    *length = chord + chord * more;
    *vertical = tension * (sine + x * (1 + more) + sine * (square / (1 + cosh_h) - run) / (1 + run));
    return SAGLINE_SOLVED;
}

static real square_error(real a, real square) /* a a - square, exactly (Dekker) */
{
    const real split = SPLIT * a, high = split - (split - a), low = a - high;
    return ((high * high - square) + 2 * high * low) + low * low;
}

/* P2: the force of a cable of given length. The unknown is h = wD/(2 tau) less its stretch; Halley in a bracket. */
int sagline_tension(real span, real rise, real length, real weight, real stiffness, real force[2], real *tension)
{
    const real level = larger(span, EPSILON * fabs(rise)); /* a vertical chord, as one that leans by a last digit */
    const real x2 = level * level, z2 = rise * rise, l2 = length * length, d2 = x2 + z2, difference = d2 - l2;
    if (!(span >= 0 && d2 > 0 && d2 <= LARGEST && length > 0 && l2 <= LARGEST && weight >= 0 && stiffness > 0))
        return SAGLINE_BAD_INPUT;
    real part = d2 - x2, tail = (x2 - (d2 - part)) + (z2 - part);
    part = difference - d2;
    tail += (d2 - (difference - part)) - (l2 + part);
    tail += square_error(level, x2) + square_error(rise, z2) - square_error(length, l2);
    const real excess = (difference + tail) / l2; /* (D^2 - L^2)/L^2, without rounding in the difference */
    if (weight == 0 && !(excess > 0))
        return SAGLINE_DEEP_SAG;
    const real kappa = larger(weight * length / (2 * stiffness), LIGHTEST), half_weight = kappa * stiffness / length;
    const real xi2 = x2 / l2, zeta2 = z2 / l2, p = 3 * excess / xi2, q = 6 * kappa * (1 + excess) / xi2;
    real low = 0, high = R(INFINITY), h = sqrt(p < 0 ? -p : 0) + cbrt(q);
    h = p * h > q ? q / p : h;
    h -= (h * (h * h + p) - q) / (3 * h * h + p); /* towards the root of h^3 + p h = q, from above */
    h = h < DEEPEST ? h : DEEPEST;
    bool settled = false;
    for (int k = 0; k < CABLE_STEPS; k++) {
        const real more = h * h * h * sinh_excess(h * h), s = h + more, c = sqrt(1 + s * s);
        const real total = 1 / (h + kappa), lever = 1 / (s + kappa * c);
        if (settled) {
            const real chord_tension = half_weight * total * sqrt(d2);
            if (!(chord_tension <= STRAINED * stiffness))
                return SAGLINE_OVERSTRAINED;
            force[0] = half_weight * total * span;
            force[1] = half_weight * (length + rise * c * lever);
            *tension = chord_tension;
            return SAGLINE_SOLVED;
        }
        const real a = s * total, alpha = (more - kappa) * total;
        const real alpha1 = (c - a) * total, alpha2 = (s - 2 * alpha1) * total;
        const real e = s * lever, eta = -kappa * c * lever, eta1 = kappa * lever * lever;
        const real error = excess + xi2 * alpha * (2 + alpha) + zeta2 * eta * (2 + eta);
        const real slope = 2 * (xi2 * a * alpha1 + zeta2 * e * eta1);
        const real bend = xi2 * (alpha1 * alpha1 + a * alpha2)
            + zeta2 * eta1 * (eta1 - 2 * e * lever * (c + kappa * s));
        if (error > 0)
            high = h;
        else
            low = h;
        if (!(low < DEEPEST))
            return SAGLINE_DEEP_SAG;
        real next = h - error * slope / (slope * slope - error * bend);
        if (!(next >= low && next <= high))
            next = (low + high) / 2;
        next = next < DEEPEST ? next : DEEPEST;
        settled = fabs(next - h) <= STILL * (h + kappa);
        h = next;
    }
    return SAGLINE_NOT_CONVERGED;
}

static const real FRAME[M][3] = SAGLINE_FRAME_ANCHORS, LEVER[M][3] = SAGLINE_LEVERS;
static const real WEIGHT[M] = SAGLINE_WEIGHT_PER_LENGTH, STIFFNESS[M] = SAGLINE_AXIAL_STIFFNESS;
static const real LOW[M] = SAGLINE_TENSION_MIN, HIGH[M] = SAGLINE_TENSION_MAX;
static const real CENTER[3] = SAGLINE_CENTER_OF_MASS, FREEDOM[N][6] = SAGLINE_FREEDOM;

static real dot(const real *a, const real *b, int count)
{
    real total = 0;
    for (int i = 0; i < count; i++)
        total += a[i] * b[i];
    return total;
}

/* The chords, from frame end to platform end: horizontal part, vertical part, length */
typedef struct {
    real span, rise, chord;
} line;

/* The columns (u; r x u) of the structure matrix, the chords, and lever arms r about the center of mass */
static bool place(const real position[3], const real rotation[9], real matrix[6][M], line lines[M], real lever[3][M])
{
    real center[3];
    for (int k = 0; k < 3; k++) {
        const real *row = &rotation[3 * k], *next = &rotation[3 * ((k + 1) % 3)];
        if (!(fabs(dot(row, row, 3) - 1) + fabs(dot(row, next, 3)) <= TURNED))
            return false;
        center[k] = position[k] + dot(row, CENTER, 3);
    }
    for (int i = 0; i < M; i++) {
        real way[3], r[3];
        for (int k = 0; k < 3; k++) {
            lever[k][i] = r[k] = dot(&rotation[3 * k], LEVER[i], 3);
            way[k] = center[k] + r[k] - FRAME[i][k];
        }
        const real level2 = way[0] * way[0] + way[1] * way[1], d2 = level2 + way[2] * way[2];
        if (!(d2 > 0 && d2 <= LARGEST))
            return false;
        lines[i] = (line){sqrt(level2), way[2], sqrt(d2)};
        for (int k = 0; k < 3; k++) {
            const int x = (k + 1) % 3, y = (k + 2) % 3;
            matrix[k][i] = -way[k] / lines[i].chord;
            matrix[3 + k][i] = (r[y] * way[x] - r[x] * way[y]) / lines[i].chord;
        }
    }
    return true;
}

int sagline_structure_matrix(const real position[3], const real rotation[9], real matrix[6][M])
{
    line lines[M];
    real lever[3][M];
    return place(position, rotation, matrix, lines, lever) ? SAGLINE_SOLVED : SAGLINE_BAD_INPUT;
}

static void reflect(const real *normal, real factor, real *vector, int count)
{
    const real share = factor * dot(normal, vector, count);
    for (int i = 0; i < count; i++)
        vector[i] -= share * normal[i];
}

/* Householder: row k of a (N, M) becomes column k of the triangular factor of its transpose, then a reflection */
static bool factorize(real a[N][M], real head[N], real factor[N])
{
    for (int k = 0; k < N; k++) {
        const real square = dot(&a[k][k], &a[k][k], M - k), norm = sqrt(square);
        if (!(square > RANK * RANK * (square + dot(a[k], a[k], k))))
            return false;
        head[k] = -copysign(norm, a[k][k]);
        factor[k] = 1 / (norm * (norm + fabs(a[k][k])));
        a[k][k] -= head[k];
        for (int j = k + 1; j < N; j++)
            reflect(&a[k][k], factor[k], &a[j][k], M - k);
    }
    return true;
}

static void turn(real a[N][M], const real factor[N], real vector[M]) /* times the orthogonal factor */
{
    for (int k = N - 1; k >= 0; k--)
        reflect(&a[k][k], factor[k], &vector[k], M - k);
}

/* One side of a cable's limits, 2 i the lower and 2 i + 1 the upper: the points with g . point >= offset */
static real side(int label, const real start[M], real null[2][M], real g[2])
{
    const int i = label / 2;
    const real sign = label % 2 ? -1 : 1;
    g[0] = sign * null[0][i];
    g[1] = sign * null[1][i];
    return sign * ((label % 2 ? HIGH[i] : LOW[i]) - start[i]);
}

/* Move a point to the nearest one within all limits. Side by side: where one is missed, the nearest point of all so
 * far lies on it. False where they have nothing in common. */
static bool nearest(const real start[M], real null[2][M], real slack, real point[2])
{
    const real goal[2] = {point[0], point[1]};
    real g[2], o[2];
    for (int k = 0; k < 2 * M; k++) {
        const real miss = side(k, start, null, g) - dot(g, point, 2), size = dot(g, g, 2);
        if (!(miss > slack))
            continue;
        if (!(size > EPSILON * EPSILON))
            return false;
        const real way = (side(k, start, null, g) - dot(g, goal, 2)) / size;
        const real foot[2] = {goal[0] + way * g[0], goal[1] + way * g[1]};
        real low = -R(INFINITY), high = R(INFINITY);
        for (int j = 0; j < k; j++) {
            const real rest = side(j, start, null, o) - dot(o, foot, 2), pace = g[0] * o[1] - g[1] * o[0];
            if (fabs(pace) <= 16 * EPSILON * size) {
                if (rest > slack)
                    return false;
            } else if (pace > 0)
                low = larger(low, rest / pace);
            else
                high = rest / pace < high ? rest / pace : high;
        }
        if (low > high && (low - high) * (low - high) * size > slack * slack)
            return false;
        const real along = low > 0 ? low : high < 0 ? high : 0;
        point[0] = foot[0] - along * g[1];
        point[1] = foot[1] + along * g[0];
    }
    return true;
}

/* The wrench that the chord tensions must supply, along the free motions: weight, wrench and what the cables weigh */
static void need(const real *wrench, real lever[3][M], const real pull[M], real right[N])
{
    real needed[6] = {0, 0, SAGLINE_MASS * SAGLINE_GRAVITY, 0, 0, 0};
    for (int i = 0; i < M; i++) {
        needed[2] += pull[i];
        needed[3] += lever[1][i] * pull[i];
        needed[4] -= lever[0][i] * pull[i];
    }
    for (int k = 0; k < 6 && wrench != NULL; k++)
        needed[k] -= wrench[k];
    for (int k = 0; k < N; k++)
        right[k] = dot(FREEDOM[k], needed, 6);
}

/* Rounds of sharing and hanging until the pulls T_z - tau sin phi, which the cables' weight adds, stand still */
int sagline_inverse(const real position[3], const real rotation[9], const real *wrench, const real *previous,
                    real tension[M], real length[M])
{
    line lines[M];
    real matrix[6][M], lever[3][M], reduced[N][M], head[N], factor[N], null[2][M];
    real pull[M], shared[M], hung[M], right[N], goal[2] = {0, 0};
    if (!place(position, rotation, matrix, lines, lever))
        return SAGLINE_BAD_INPUT;
    for (int i = 0; i < M; i++) {
        pull[i] = WEIGHT[i] * lines[i].chord / 2;
        for (int k = 0; k < N; k++) {
            reduced[k][i] = 0;
            for (int j = 0; j < 6; j++)
                reduced[k][i] += FREEDOM[k][j] * matrix[j][i];
        }
    }
    if (!factorize(reduced, head, factor))
        return SAGLINE_SINGULAR;
    for (int k = 0; k < 2; k++) {
        for (int i = 0; i < M; i++)
            null[k][i] = i == N + k ? 1 : 0;
        turn(reduced, factor, null[k]);
        goal[k] = previous != NULL ? dot(null[k], previous, M) : 0;
    }
    for (int round = 0; round < ROUNDS; round++) {
        real start[M] = {0}, point[2] = {goal[0], goal[1]}, largest = 0, change = 0;
        need(wrench, lever, pull, right);
        for (int k = 0; k < N; k++) /* the shortest tensions that supply it */
            start[k] = (right[k] - dot(reduced[k], start, k)) / head[k];
        turn(reduced, factor, start);
        for (int i = 0; i < M; i++)
            largest = larger(larger(largest, fabs(start[i])), HIGH[i] < R(INFINITY) ? HIGH[i] : LOW[i]);
        if (!nearest(start, null, 16 * EPSILON * largest, point))
            return SAGLINE_INFEASIBLE;
        for (int i = 0; i < M; i++) {
            real vertical;
            shared[i] = start[i] + point[0] * null[0][i] + point[1] * null[1][i];
            const int status = sagline_length(lines[i].span, lines[i].rise, shared[i], WEIGHT[i], STIFFNESS[i],
                                              &hung[i], &vertical);
            if (status != SAGLINE_SOLVED)
                return status;
            const real before = pull[i];
            pull[i] = vertical + shared[i] * matrix[2][i];
            change = larger(change, fabs(pull[i] - before));
        }
        if (change <= 8 * EPSILON * largest) {
            for (int i = 0; i < M; i++) {
                tension[i] = shared[i];
                length[i] = hung[i];
            }
            return SAGLINE_SOLVED;
        }
    }
    return SAGLINE_NOT_CONVERGED;
}
