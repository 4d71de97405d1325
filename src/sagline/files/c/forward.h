
/* Pose at which the platform is in equilibrium on cables of unstrained lengths [m] off the drums. wrench: NULL for none;
 * pose: start of the solution, replaced by the result, as are the chord tensions [N]: with SAGLINE_SOLVED and the
 * statuses SAGLINE_FORWARD_LOOSE to SAGLINE_FORWARD_SINGULAR. At most @forward_operations@ floating-point operations. */
int sagline_forward(sagline_work *work, const sagline_real length[SAGLINE_CABLES], const sagline_real *wrench,
                    sagline_real pose[7], sagline_real tension[SAGLINE_CABLES]);

/* The same without a start: from the middle of the frame with a level platform, first the translations alone, in at
 * most twice as many operations. */
int sagline_search(sagline_work *work, const sagline_real length[SAGLINE_CABLES], const sagline_real *wrench,
                   sagline_real pose[7], sagline_real tension[SAGLINE_CABLES]);
