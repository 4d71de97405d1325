/* sagline.h: @name@ for sagline.c, written by sagline @version@.
 *
 * Its constants, and the functions that sagline.c offers. SI units, z up. Forces act on the cable at its platform end.
 * Cables are numbered from 0. What a function fills counts only where it returns SAGLINE_SOLVED. */
#ifndef SAGLINE_H
#define SAGLINE_H

@precision@
#define SAGLINE_CABLES @cables@
#define SAGLINE_FREEDOMS @freedoms@
#define SAGLINE_MASS @mass@ /* kg, platform and load */
#define SAGLINE_GRAVITY @gravity@ /* m/s^2 */
#define SAGLINE_CENTER_OF_MASS @center_of_mass@ /* m, in the platform frame */
/* m, in the world */
#define SAGLINE_FRAME_ANCHORS @frame_anchors@
/* m, platform anchors less center of mass, in the platform frame */
#define SAGLINE_LEVERS @levers@
/* N/m, of the cables */
#define SAGLINE_WEIGHT_PER_LENGTH @weight@
/* N, EA of the cables */
#define SAGLINE_AXIAL_STIFFNESS @stiffness@
/* N, limits of the chord tensions */
#define SAGLINE_TENSION_MIN @tension_min@
#define SAGLINE_TENSION_MAX @tension_max@
/* free motions: rows of force, then moment, along which the platform is balanced */
#define SAGLINE_FREEDOM @freedom@

enum {
    SAGLINE_SOLVED,       /* the answer is filled */
    SAGLINE_BAD_INPUT,    /* no number, a negative one, no rotation, or a cable without a chord */
    SAGLINE_DEEP_SAG,     /* wD/(2 tau) > 2, or slack: nothing here covers such cables; more tension, or less length */
    SAGLINE_OVERSTRAINED, /* stretched by more than a tenth: less tension, or more length */
    SAGLINE_SINGULAR,     /* the cables cannot resist every motion there: another pose */
    SAGLINE_INFEASIBLE,   /* no tensions within the limits balance the platform there: another pose, or less load */
    SAGLINE_NOT_CONVERGED /* the steps did not settle: keep the last answer and tell the operator */
};

/* P2: force (T_x, T_z) [N] and chord tension [N] of a cable of an unstrained length [m] between given ends.
 * span >= 0 and rise: horizontal and vertical part of the line from the frame end to the platform end [m];
 * weight: per unstrained length [N/m]; stiffness: EA [N]. */
int sagline_tension(sagline_real span, sagline_real rise, sagline_real length, sagline_real weight,
                    sagline_real stiffness, sagline_real force[2], sagline_real *tension);

/* P3: unstrained length [m] and T_z [N] of a cable at a chord tension [N]; T_x is tension * span/chord. */
int sagline_length(sagline_real span, sagline_real rise, sagline_real tension, sagline_real weight,
                   sagline_real stiffness, sagline_real *length, sagline_real *vertical);

/* Structure matrix at a pose: what a unit of each chord tension gives the platform, force and moment about its center
 * of mass. position: of the platform frame's origin [m]; rotation: platform to world, row by row. */
int sagline_structure_matrix(const sagline_real position[3], const sagline_real rotation[9],
                             sagline_real matrix[6][SAGLINE_CABLES]);

/* Chord tensions [N] within their limits that hold the platform at a pose, and the unstrained lengths [m] to wind.
 * wrench: external and inertial force [N], moment [N m] about the center of mass, world axes, 6 numbers; NULL for none.
 * previous: chord tensions to stay nearest to, of the pose before (sagline: Closest; may be the array to fill);
 * NULL for those of least norm (MinimumNorm). Where it fails, tension and length stay as they are. */
int sagline_inverse(const sagline_real position[3], const sagline_real rotation[9], const sagline_real *wrench,
                    const sagline_real *previous, sagline_real tension[SAGLINE_CABLES],
                    sagline_real length[SAGLINE_CABLES]);

#endif
