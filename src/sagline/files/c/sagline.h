/* @header@: @name@, written by sagline @version@.
 *
 * Kinematics of this robot. SI units, z up, angles in radians. Cables are numbered from 0. The functions use no heap, no
 * recursion and no state besides the work memory that they are given: one for each thread.
 * A pose is the position [m] of the platform origin and the unit quaternion platform to world, scalar last. A wrench is
 * the external and inertial force [N], then moment [N m] about the center of mass, in world axes, without gravity.
 * Results are written with the status SAGLINE_SOLVED only, unless a function says more. */
#ifndef SAGLINE_H
#define SAGLINE_H

#include <stdint.h>

typedef @real@ sagline_real;
#define SAGLINE_CABLES @cables@
#define SAGLINE_FREEDOMS @freedoms@

/* tension distribution methods of this source */
enum { @methods@, SAGLINE_METHODS };

/* status of a function */
enum {
@statuses@
};

/* work memory; its content does not matter */
typedef struct {
    sagline_real numbers[@numbers@], results[@results@], others[@others@];
    int32_t counters[@counters@];
    int8_t statuses[SAGLINE_CABLES + 1];
} sagline_work;

/* Tensions that balance the platform at a pose within their limits, and the unstrained lengths of cable off the drums.
 * method: one of the list above; wrench: NULL for none; previous: NULL, or the tensions of the pose before in the
 * variable of the method [N], which SAGLINE_CLOSEST stays near to and replaces by the new ones; NAN for none;
 * length: [m]; tension: chord tensions [N]. At most @inverse_operations@ floating-point operations: the product of the
 * bounds of all loops, which no pose comes near. */
int sagline_inverse(sagline_work *work, int method, const sagline_real pose[7], const sagline_real *wrench,
                    sagline_real *previous, sagline_real length[SAGLINE_CABLES], sagline_real tension[SAGLINE_CABLES]);
@forward@
#endif
