/* Kinematics of @name@ for LinuxCNC, written by sagline @version@. Do not edit.
 * Install: halcompile --install @module@.c; the settings for the INI file are in @module@.ini. For LinuxCNC in user space
 * (uspace), because kernel modules of RTAI have no C library.
 *
 * World: X, Y, Z of the platform origin, and A, B, C [degrees], rotations about the fixed axes x, y, z in this order.
 * Joints: unstrained lengths off the drums. All in machine units, @unit@. */
#ifdef __KERNEL__
#error "this module is for LinuxCNC in user space"
#endif
#include "kinematics.h"
#include "rtapi.h"
#include "rtapi_app.h"
#include "hal.h"

