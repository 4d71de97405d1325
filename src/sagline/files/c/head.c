/* Functions of @header@, written by sagline @version@: its kernels, translated, and the data of a robot. Do not edit.
 * Compile with -std=c99 -ffp-contract=off; never with -ffast-math. */
#ifdef __FAST_MATH__
#error "compile without -ffast-math: it changes differences that the results need"
#endif
#include "@header@"

#include <stddef.h>
