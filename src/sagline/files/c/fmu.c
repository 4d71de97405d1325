/* @name@ as a unit of co-simulation for FMI @fmi@, written by sagline @version@: its kernels, translated, and the data of
 * a robot. Do not edit. Compile with -std=c99 -O2 -ffp-contract=off; never with -ffast-math. */
#ifdef __FAST_MATH__
#error "compile without -ffast-math: it changes differences that the results need"
#endif
@kernels@
#include <stddef.h>
#include <string.h>

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif
#define CABLES @cables@
#define INPUTS (CABLES + 6)
#define VARIABLES @variables@
#define TIME @time@
#define LONGEST 10000000 /* steps in one communication step */
enum { OK, WARNING, DISCARD, FAILED };

/* simulated robot at its start; index of each variable in the numbers, by value reference, inputs first */
typedef struct {
    double numbers[@size@];
    int32_t counters[@counters_size@];
} State;
static const State START = {{@numbers@}, {@counters@}};
static const int PLACES[VARIABLES] = {@places@};
static const double STEP = @step@; /* s */

/* One communication step [s]; the set points of the lengths change linearly. Returns NULL, or the reason of a failure,
 * which leaves the state unchanged unless the energy grows. */
static const char *advance(State *now, double period)
{
    double *numbers = now->numbers;
    const double parts = period / STEP, count = rint(parts);
    bool begun = false;
    if (!(count >= 1 && count <= LONGEST && fabs(parts - count) <= 1e-6))
        return "the communication step is not a whole multiple of @step@ s, the step of the integrator";
    for (int i = 0; i < CABLES; i++)
        numbers[@asked@ + i] = @set_point@;
    begin_period(@begin_period@, false, true, (now->counters[0] + count) * STEP, &begun);
    if (!begun)
        return "an input is not finite or too large, or a cable would not be longer than its dead length";
    @run@(@run_massless@, (int32_t)count, 0);
    if (now->counters[@failed@])
        return "the energy grows without a cause: export the robot with a shorter step";
    platform_state(@platform_state@);
    return NULL;
}

typedef struct Instance Instance;
static int fail(Instance *instance, const char *reason);
static State *state_of(Instance *instance);

static int get(Instance *instance, const unsigned *references, size_t count, double *values)
{
    for (size_t k = 0; k < count; k++) {
        if (references[k] >= VARIABLES)
            return fail(instance, "a value reference does not exist");
        values[k] = state_of(instance)->numbers[PLACES[references[k]]];
    }
    return OK;
}

static int set(Instance *instance, const unsigned *references, size_t count, const double *values)
{
    for (size_t k = 0; k < count; k++) {
        if (references[k] >= INPUTS)
            return fail(instance, "only inputs can be set");
        state_of(instance)->numbers[PLACES[references[k]]] = values[k];
    }
    return OK;
}

static int step(Instance *instance, double time, double period)
{
    const char *reason = advance(state_of(instance), period);
    if (reason != NULL)
        return fail(instance, reason);
    state_of(instance)->numbers[TIME] = time + period;
    return OK;
}

static int save(Instance *instance, void **saved)
{
    if (*saved == NULL)
        *saved = malloc(sizeof(State));
    if (*saved == NULL)
        return fail(instance, "no memory is left");
    memcpy(*saved, state_of(instance), sizeof(State));
    return OK;
}

static int drop(void **saved)
{
    free(*saved);
    *saved = NULL;
    return OK;
}

/* Functions that change nothing, functions for variables of types that this unit does not have, others. */
#define NOTHING(name) EXPORT int name(Instance *instance) { (void)instance; return OK; }
#define NO_VARIABLES(name) EXPORT int name(Instance *instance, const unsigned *references, size_t count) \
    { (void)references; return count ? fail(instance, #name ": all variables are numbers of 64 bits") : OK; }
#define NONE(name) EXPORT int name(Instance *instance) { return fail(instance, #name " is not supported"); }
