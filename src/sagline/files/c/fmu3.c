
typedef void (*Log)(void *environment, int status, const char *category, const char *text);

struct Instance {
    State now;
    Log log;
    void *environment;
};

static State *state_of(Instance *instance) { return &instance->now; }

static int fail(Instance *instance, const char *reason)
{
    if (instance->log != NULL)
        instance->log(instance->environment, FAILED, "logStatusError", reason);
    return FAILED;
}

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

EXPORT void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible,
                                         bool logging, bool events, bool early, const unsigned *required, size_t count,
                                         void *environment, Log log, void *update)
{
    (void)name, (void)resources, (void)visible, (void)logging, (void)events, (void)early, (void)required, (void)update;
    Instance *made = count == 0 && strcmp(token, "@token@") == 0 ? calloc(1, sizeof(Instance)) : NULL;
    if (made == NULL)
        return NULL;
    made->now = START;
    made->log = log;
    made->environment = environment;
    return made;
}

EXPORT void *fmi3InstantiateModelExchange(void) { return NULL; }
EXPORT void *fmi3InstantiateScheduledExecution(void) { return NULL; }
EXPORT void fmi3FreeInstance(Instance *instance) { free(instance); }

EXPORT int fmi3EnterInitializationMode(Instance *instance, bool with_tolerance, double tolerance, double start,
                                       bool with_stop, double stop)
{
    (void)with_tolerance, (void)tolerance, (void)with_stop, (void)stop;
    instance->now.numbers[TIME] = start;
    return OK;
}

EXPORT int fmi3Reset(Instance *instance) { instance->now = START; return OK; }

EXPORT int fmi3DoStep(Instance *instance, double time, double period, bool kept, bool *event, bool *end, bool *early,
                      double *last)
{
    (void)kept;
    *event = *end = *early = false;
    const int status = step(instance, time, period);
    *last = status == OK ? time + period : time;
    return status;
}

EXPORT int fmi3GetFloat64(Instance *instance, const unsigned *references, size_t count, double *values, size_t values_count)
{
    return values_count == count ? get(instance, references, count, values) : fail(instance, "all variables are scalars");
}

EXPORT int fmi3SetFloat64(Instance *instance, const unsigned *references, size_t count, const double *values,
                          size_t values_count)
{
    return values_count == count ? set(instance, references, count, values) : fail(instance, "all variables are scalars");
}

EXPORT int fmi3GetFMUState(Instance *instance, void **saved) { return save(instance, saved); }
EXPORT int fmi3SetFMUState(Instance *instance, void *saved) { instance->now = *(State *)saved; return OK; }
EXPORT int fmi3FreeFMUState(Instance *instance, void **saved) { (void)instance; return drop(saved); }

NOTHING(fmi3SetDebugLogging) NOTHING(fmi3ExitInitializationMode) NOTHING(fmi3Terminate)
NO_VARIABLES(fmi3GetFloat32) NO_VARIABLES(fmi3GetInt8) NO_VARIABLES(fmi3GetUInt8) NO_VARIABLES(fmi3GetInt16)
NO_VARIABLES(fmi3GetUInt16) NO_VARIABLES(fmi3GetInt32) NO_VARIABLES(fmi3GetUInt32) NO_VARIABLES(fmi3GetInt64)
NO_VARIABLES(fmi3GetUInt64) NO_VARIABLES(fmi3GetBoolean) NO_VARIABLES(fmi3GetString) NO_VARIABLES(fmi3GetBinary)
NO_VARIABLES(fmi3GetClock)
NO_VARIABLES(fmi3SetFloat32) NO_VARIABLES(fmi3SetInt8) NO_VARIABLES(fmi3SetUInt8) NO_VARIABLES(fmi3SetInt16)
NO_VARIABLES(fmi3SetUInt16) NO_VARIABLES(fmi3SetInt32) NO_VARIABLES(fmi3SetUInt32) NO_VARIABLES(fmi3SetInt64)
NO_VARIABLES(fmi3SetUInt64) NO_VARIABLES(fmi3SetBoolean) NO_VARIABLES(fmi3SetString) NO_VARIABLES(fmi3SetBinary)
NO_VARIABLES(fmi3SetClock)
NONE(fmi3SerializedFMUStateSize) NONE(fmi3SerializeFMUState) NONE(fmi3DeserializeFMUState)
NONE(fmi3GetNumberOfVariableDependencies) NONE(fmi3GetVariableDependencies) NONE(fmi3GetDirectionalDerivative)
NONE(fmi3GetAdjointDerivative) NONE(fmi3EnterConfigurationMode) NONE(fmi3ExitConfigurationMode)
NONE(fmi3GetIntervalDecimal) NONE(fmi3GetIntervalFraction) NONE(fmi3GetShiftDecimal) NONE(fmi3GetShiftFraction)
NONE(fmi3SetIntervalDecimal) NONE(fmi3SetIntervalFraction) NONE(fmi3SetShiftDecimal) NONE(fmi3SetShiftFraction)
NONE(fmi3EvaluateDiscreteStates) NONE(fmi3UpdateDiscreteStates) NONE(fmi3EnterEventMode)
NONE(fmi3EnterContinuousTimeMode) NONE(fmi3CompletedIntegratorStep) NONE(fmi3SetTime) NONE(fmi3SetContinuousStates)
NONE(fmi3GetContinuousStateDerivatives) NONE(fmi3GetEventIndicators) NONE(fmi3GetContinuousStates)
NONE(fmi3GetNominalsOfContinuousStates) NONE(fmi3GetNumberOfEventIndicators) NONE(fmi3GetNumberOfContinuousStates)
NONE(fmi3EnterStepMode) NONE(fmi3GetOutputDerivatives) NONE(fmi3ActivateModelPartition)
