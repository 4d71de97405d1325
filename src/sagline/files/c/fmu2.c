
typedef struct {
    void (*log)(void *environment, const char *instance, int status, const char *category, const char *text, ...);
    void *(*allocate)(size_t count, size_t size);
    void (*release)(void *memory);
    void (*finished)(void *environment, int status);
    void *environment;
} Callbacks;

struct Instance {
    State now;
    char name[64];
    Callbacks callbacks;
};

static State *state_of(Instance *instance) { return &instance->now; }

static int fail(Instance *instance, const char *reason)
{
    if (instance->callbacks.log != NULL)
        instance->callbacks.log(instance->callbacks.environment, instance->name, FAILED, "logStatusError", reason);
    return FAILED;
}

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

EXPORT void *fmi2Instantiate(const char *name, int type, const char *token, const char *resources,
                             const Callbacks *callbacks, int visible, int logging)
{
    (void)resources, (void)visible, (void)logging;
    Instance *made = type == 1 && strcmp(token, "@token@") == 0 ? calloc(1, sizeof(Instance)) : NULL;
    if (made == NULL)
        return NULL;
    made->now = START;
    strncpy(made->name, name, sizeof made->name - 1);
    made->callbacks = *callbacks;
    return made;
}

EXPORT void fmi2FreeInstance(Instance *instance) { free(instance); }

EXPORT int fmi2SetupExperiment(Instance *instance, int with_tolerance, double tolerance, double start, int with_stop,
                               double stop)
{
    (void)with_tolerance, (void)tolerance, (void)with_stop, (void)stop;
    instance->now.numbers[TIME] = start;
    return OK;
}

EXPORT int fmi2Reset(Instance *instance) { instance->now = START; return OK; }

EXPORT int fmi2DoStep(Instance *instance, double time, double period, int kept)
{
    (void)kept;
    return step(instance, time, period);
}

EXPORT int fmi2GetReal(Instance *instance, const unsigned *references, size_t count, double *values)
{
    return get(instance, references, count, values);
}

EXPORT int fmi2SetReal(Instance *instance, const unsigned *references, size_t count, const double *values)
{
    return set(instance, references, count, values);
}

EXPORT int fmi2GetFMUstate(Instance *instance, void **saved) { return save(instance, saved); }
EXPORT int fmi2SetFMUstate(Instance *instance, void *saved) { instance->now = *(State *)saved; return OK; }
EXPORT int fmi2FreeFMUstate(Instance *instance, void **saved) { (void)instance; return drop(saved); }

NOTHING(fmi2SetDebugLogging) NOTHING(fmi2EnterInitializationMode) NOTHING(fmi2ExitInitializationMode)
NOTHING(fmi2Terminate)
NO_VARIABLES(fmi2GetInteger) NO_VARIABLES(fmi2GetBoolean) NO_VARIABLES(fmi2GetString)
NO_VARIABLES(fmi2SetInteger) NO_VARIABLES(fmi2SetBoolean) NO_VARIABLES(fmi2SetString)
NONE(fmi2SerializedFMUstateSize) NONE(fmi2SerializeFMUstate) NONE(fmi2DeSerializeFMUstate)
NONE(fmi2GetDirectionalDerivative) NONE(fmi2SetRealInputDerivatives) NONE(fmi2GetRealOutputDerivatives)
NONE(fmi2CancelStep) NONE(fmi2GetStatus) NONE(fmi2GetRealStatus) NONE(fmi2GetIntegerStatus)
NONE(fmi2GetBooleanStatus) NONE(fmi2GetStringStatus)
