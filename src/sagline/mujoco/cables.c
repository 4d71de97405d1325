/* The engine plug-in sagline.cables of MuJoCo: all cables of one robot as passive forces, winches and a sensor.
 *
 * The kernels of sagline stand above this text. An instance of the plug-in belongs to one body, the platform. Actuators
 * of the instance change the lengths of its cables, one for each cable in their order. A sensor of the instance reads
 * the tensions at the frame ends. The state of the instance starts the next solution of the cables. */

enum { STARTS = 3, SHOWN = 24 }; /* rows of the state; segments of a drawn cable */

enum { FRAME, PLATFORM, DENSITY, EA, LENGTHS, RADIUS, ENTERS, DEAD, RISE, LOSS_TIME, AIR, ATTRIBUTES };
static const char *const attributes[ATTRIBUTES] = {
    "frame_anchors", "platform_anchors", "linear_density", "axial_stiffness", "unstrained_length", "pulley_radius",
    "pulley_entry", "dead_cable", "dead_rise", "loss_time", "air_damping"};

typedef struct {
    int m, body, winches, free; /* free: first degree of freedom of the body's free joint, or -1 */
    bool routed;                /* pulleys or dead lengths */
    double losses[2];
    int *winch; /* actuator of each cable */
    double *table, *length, *data, *now, *rows;
    double rotation[9], wrenches[12];
} Cables;

/* numbers of an attribute, at most `room`; their count, or -1 for a text that is not a list of numbers */
static int numbers_of(const mjModel *m, int instance, int which, double *into, int room)
{
    const char *text = mj_getPluginConfig(m, instance, attributes[which]);
    int count = 0;
    while (text != NULL) {
        char *end;
        const double value = strtod(text, &end);
        if (end == text)
            return text[strspn(text, " \t\r\n")] == 0 ? count : -1;
        if (count < room)
            into[count] = value;
        count++;
        text = end;
    }
    return count;
}

static int cable_count(const mjModel *m, int instance)
{
    const int count = numbers_of(m, instance, LENGTHS, NULL, 0);
    return count > 0 ? count : 0;
}

/* fill columns of the table from an attribute with one row, or one row for each cable; false after a warning */
static bool fill(const mjModel *m, int instance, int which, int wide, double otherwise, double *table, int stride,
                 int count)
{
    double *given = malloc(sizeof(double) * (size_t)(wide * count));
    const int found = numbers_of(m, instance, which, given, wide * count);
    const bool whole = found == wide * count, right = whole || found == wide || (found == 0 && !isnan(otherwise));
    if (found < 0)
        mju_warning("sagline.cables: %s is not a list of numbers", attributes[which]);
    else if (!right)
        mju_warning("sagline.cables: %s has %d numbers; give %d, or %d for each cable", attributes[which], found, wide,
                    wide);
    for (int i = 0; right && i < count; i++)
        for (int k = 0; k < wide; k++)
            table[stride * i + k] = found == 0 ? otherwise : given[whole ? wide * i + k : k];
    free(given);
    return right;
}

/* false after a warning if a column has a number outside of its range */
static bool in_range(const double *column, int stride, int count, double low, bool above, const char *name)
{
    for (int i = 0; i < count; i++) {
        const double value = column[stride * i];
        if (!(above ? value > low : value >= low) || isinf(value)) {
            mju_warning("sagline.cables: %s of cable %d is %g; give a number %s %g", name, i, value, above ? ">" : ">=",
                        low);
            return false;
        }
    }
    return true;
}

static bool read_numbers(const mjModel *m, int instance, Cables *it)
{
    double *table = it->table;
    const double none = NAN;
    const int n = it->m, wide = @tables.CABLE_COLUMNS@;
    const bool read = fill(m, instance, FRAME, 3, none, table + @tables.FRAME_X@, wide, n) &&
                      fill(m, instance, PLATFORM, 3, none, table + @tables.PLATFORM_X@, wide, n) &&
                      fill(m, instance, DENSITY, 1, none, table + @tables.DENSITY@, wide, n) &&
                      fill(m, instance, EA, 1, none, table + @tables.STIFFNESS@, wide, n) &&
                      fill(m, instance, LENGTHS, 1, none, it->length, 1, n) &&
                      fill(m, instance, RADIUS, 1, 0, table + @tables.PULLEY_RADIUS@, wide, n) &&
                      fill(m, instance, ENTERS, 1, 1, table + @tables.ENTRY@, wide, n) &&
                      fill(m, instance, DEAD, 1, 0, table + @tables.DEAD_CABLE@, wide, n) &&
                      fill(m, instance, RISE, 1, 0, table + @tables.DEAD_RISE@, wide, n) &&
                      fill(m, instance, LOSS_TIME, 1, 0, it->losses, 1, 1) &&
                      fill(m, instance, AIR, 1, 0, it->losses + 1, 1, 1);
    if (!read || !in_range(table + @tables.DENSITY@, wide, n, 0, false, attributes[DENSITY]) ||
        !in_range(table + @tables.STIFFNESS@, wide, n, 0, true, attributes[EA]) ||
        !in_range(table + @tables.PULLEY_RADIUS@, wide, n, 0, false, attributes[RADIUS]) ||
        !in_range(table + @tables.DEAD_CABLE@, wide, n, 0, false, attributes[DEAD]) ||
        !in_range(it->losses, 1, 2, 0, false, "loss_time or air_damping"))
        return false;
    for (int i = 0; i < n; i++) {
        const double *row = table + wide * i;
        it->data[@drives.BEHIND_RISE@ * n + i] = row[@tables.DEAD_RISE@];
        it->routed = it->routed || row[@tables.PULLEY_RADIUS@] > 0 || row[@tables.DEAD_CABLE@] > 0;
        if (!in_range(it->length + i, 1, 1, row[@tables.DEAD_CABLE@], true, attributes[LENGTHS]))
            return false;
    }
    return true;
}

/* the body of the instance and its actuators; false after a warning */
static bool find_elements(const mjModel *m, int instance, Cables *it)
{
    int bodies = 0;
    for (int b = 0; b < m->nbody; b++)
        if (m->body_plugin[b] == instance) {
            it->body = b;
            bodies++;
        }
    for (int a = 0; a < m->nactuator; a++)
        if (m->actuator_plugin[a] == instance) {
            if (it->winches < it->m)
                it->winch[it->winches] = a;
            it->winches++;
        }
    const mjtNum *gravity = m->opt.gravity;
    const bool vertical = gravity[0] == 0 && gravity[1] == 0 && gravity[2] <= 0;
    const bool complete = it->winches == 0 || it->winches == it->m;
    if (bodies != 1)
        mju_warning("sagline.cables: %d bodies name the instance; give the plug-in to one body", bodies);
    if (!complete)
        mju_warning("sagline.cables: %d actuators for %d cables; give one for each cable, or none", it->winches, it->m);
    if (!vertical)
        mju_warning("sagline.cables: gravity is not along -z; give for example gravity=\"0 0 -9.81\"");
    if (bodies != 1 || !complete || !vertical)
        return false;
    const int joint = m->body_jntadr[it->body];
    it->free = m->body_jntnum[it->body] == 1 && m->jnt_type[joint] == mjJNT_FREE ? m->jnt_dofadr[joint] : -1;
    return true;
}

static void destroy(mjData *d, int instance)
{
    Cables *it = (Cables *)d->plugin_data[instance];
    if (it != NULL) {
        free(it->winch);
        free(it->table);
        free(it);
    }
    d->plugin_data[instance] = 0;
}

static int init(const mjModel *m, mjData *d, int instance)
{
    const int n = cable_count(m, instance);
    const size_t wide = @tables.CABLE_COLUMNS@ + 1 + @drives.DATA_ROWS@ + @drives.DRIVE_ROWS@ + @geometry.CABLE_ROWS@;
    d->plugin_data[instance] = 0;
    if (n == 0) {
        mju_warning("sagline.cables: unstrained_length is not a list of numbers; give the length of each cable");
        return -1;
    }
    Cables *it = calloc(1, sizeof(Cables));
    it->m = n;
    it->winch = calloc((size_t)n, sizeof(int));
    it->table = calloc(wide * (size_t)n, sizeof(double));
    it->length = it->table + @tables.CABLE_COLUMNS@ * n;
    it->data = it->length + n;
    it->now = it->data + @drives.DATA_ROWS@ * n;
    it->rows = it->now + @drives.DRIVE_ROWS@ * n;
    d->plugin_data[instance] = (uintptr_t)it;
    if (read_numbers(m, instance, it) && find_elements(m, instance, it))
        return 0;
    destroy(d, instance);
    return -1;
}

static double clipped(double value, const mjtNum range[2])
{
    return value < range[0] ? range[0] : value > range[1] ? range[1] : value;
}

/* lengths of the cables and their rates: the start plus the activation of the winch, or plus its control */
static void fill_lengths(const mjModel *m, const mjData *d, Cables *it)
{
    double *length = it->rows + @geometry.LENGTH@ * it->m, *rate = it->now + @drives.RATE@ * it->m;
    for (int i = 0; i < it->m; i++)
        length[i] = it->length[i];
    for (int i = 0; i < it->winches; i++) {
        const int a = it->winch[i], c = m->actuator_ctrladr[a], states = m->actuator_actnum[a];
        double control = d->ctrl[c];
        if (m->actuator_ctrllimited[c] && !mjDISABLED(mjDSBL_CLAMPCTRL))
            control = clipped(control, m->actuator_ctrlrange + 2 * c);
        if (states == 0) {
            length[i] += control;
            continue;
        }
        const double changed = d->act[m->actuator_actadr[a] + states - 1];
        const int kind = m->actuator_dyntype[a];
        length[i] += changed;
        rate[i] = kind == mjDYN_INTEGRATOR ? control
                  : kind == mjDYN_FILTER || kind == mjDYN_FILTEREXACT
                      ? (control - changed) / fmax(mjMINVAL, m->actuator_dynprm[mjNDYN * a])
                      : 0;
    }
}

/* fill the tensions and the wrench about the origin of the body */
static void solve(const mjModel *m, const mjData *d, Cables *it, int instance)
{
    static const double origin[@tables.BODY_COLUMNS@] = {0};
    const int n = it->m, b = it->body, w = @tables.CABLE_COLUMNS@;
    const double *start = d->plugin_state + m->plugin_stateadr[instance];
    const mjtNum *x = d->xpos + 3 * b, *q = d->xquat + 4 * b;
    double *rows = it->rows, state[13] = {x[0], x[1], x[2], q[1], q[2], q[3], q[0]};
    int32_t unsolved;
    fill_lengths(m, d, it);
    for (int i = 0; i < n; i++)
        rows[@geometry.PARAMETER@ * n + i] = start[i];
    if (it->losses[0] > 0 || it->losses[1] > 0) {
        mjtNum twist[6];
        mj_objectVelocity(m, d, mjOBJ_XBODY, b, twist, 0);
        for (int k = 0; k < 3; k++) {
            state[7 + k] = twist[3 + k];
            state[10 + k] = twist[k];
        }
    }
    if (it->routed) {
        for (int i = 0; i < n; i++) {
            rows[@geometry.OFF_X@ * n + i] = start[n + i];
            rows[@geometry.OFF_Z@ * n + i] = start[2 * n + i];
            rows[@geometry.OFF_LENGTH@ * n + i] = 0;
        }
        loads_over_pulleys(@codes.CATENARY@, 0, 0, -m->opt.gravity[2], true, it->losses[0], it->losses[1], it->table, n, w,
                           origin, @tables.BODY_COLUMNS@, it->data, @drives.DATA_ROWS@, n, state, 13, it->rotation, 3, 3, rows,
                           @geometry.CABLE_ROWS@, n, it->now, @drives.DRIVE_ROWS@, n, it->wrenches, 2, 6, &unsolved);
    } else {
        loads_bare(@codes.CATENARY@, 0, 0, -m->opt.gravity[2], it->losses[0], it->losses[1], it->table, n, w, origin,
                   @tables.BODY_COLUMNS@, it->data, @drives.DATA_ROWS@, n, state, 13, it->rotation, 3, 3, rows, @geometry.CABLE_ROWS@, n,
                   it->now, @drives.DRIVE_ROWS@, n, it->wrenches, 2, 6, &unsolved);
    }
}

static void apply(const mjModel *m, mjData *d, const Cables *it)
{
    const double *force = it->wrenches, *moment = force + 3;
    if (it->free < 0) {
        mj_applyFT(m, d, force, moment, d->xpos + 3 * it->body, it->body, d->qfrc_passive);
        return;
    }
    mjtNum *into = d->qfrc_passive + it->free;
    const mjtNum *turn = d->xmat + 9 * it->body; /* a free joint turns about the axes of its body */
    for (int k = 0; k < 3; k++) {
        into[k] += force[k];
        into[3 + k] += turn[k] * moment[0] + turn[3 + k] * moment[1] + turn[6 + k] * moment[2];
    }
}

static void compute(const mjModel *m, mjData *d, int instance, int capability)
{
    Cables *it = (Cables *)d->plugin_data[instance];
    const double *tension = it->now + @drives.AT_FRAME@ * it->m;
    if (capability == mjPLUGIN_PASSIVE) {
        solve(m, d, it, instance);
        apply(m, d, it);
    } else if (capability == mjPLUGIN_ACTUATOR) {
        for (int i = 0; i < it->winches; i++)
            d->actuator_force[m->actuator_outadr[it->winch[i]]] = tension[i];
    } else if (capability == mjPLUGIN_SENSOR) {
        for (int s = 0; s < m->nsensor; s++)
            for (int i = 0; i < it->m && m->sensor_plugin[s] == instance; i++)
                d->sensordata[m->sensor_adr[s] + i] = tension[i];
    }
}

/* keep the solutions of the cables for the next step */
static void advance(const mjModel *m, mjData *d, int instance)
{
    const Cables *it = (const Cables *)d->plugin_data[instance];
    double *start = d->plugin_state + m->plugin_stateadr[instance];
    for (int i = 0; i < it->m; i++) {
        const double last = it->rows[@geometry.PARAMETER@ * it->m + i];
        start[i] = isfinite(last) ? last : 0;
        start[it->m + i] = it->routed ? it->rows[@geometry.OFF_X@ * it->m + i] : 0;
        start[2 * it->m + i] = it->routed ? it->rows[@geometry.OFF_Z@ * it->m + i] : 0;
    }
}

static void reset(const mjModel *m, mjtNum *state, void *data, int instance)
{
    (void)data;
    for (int k = 0; k < m->plugin_statenum[instance]; k++)
        state[k] = 0;
}

static void draw_line(mjvScene *scene, double width, const double from[3], const double to[3])
{
    static const float color[4] = {0.85F, 0.72F, 0.4F, 1};
    if (scene->ngeom >= scene->maxgeom)
        return;
    mjvGeom *geom = scene->geoms + scene->ngeom++;
    mjv_initGeom(geom, mjGEOM_CAPSULE, NULL, NULL, NULL, color);
    mjv_connector(geom, mjGEOM_CAPSULE, width, from, to);
    geom->category = mjCAT_DECOR;
}

/* draw each cable from its frame anchor over its exit point to its platform end */
static void visualize(const mjModel *m, mjData *d, const mjvOption *options, mjvScene *scene, int instance)
{
    Cables *it = (Cables *)d->plugin_data[instance];
    (void)options;
    if (it == NULL)
        return;
    solve(m, d, it, instance);
    const int n = it->m;
    const double width = 0.0012 * m->stat.extent;
    const int at[3] = {it->routed ? @geometry.FREE_SPAN@ : @geometry.SPAN@, it->routed ? @geometry.FREE_RISE@ : @geometry.RISE@,
                       it->routed ? @geometry.FREE_LENGTH@ : @geometry.LENGTH@};
    for (int i = 0; i < n; i++) {
        const double *row = it->table + @tables.CABLE_COLUMNS@ * i, *value = it->rows + i;
        const double azimuth[3] = {value[@geometry.AZIMUTH_X@ * n], value[@geometry.AZIMUTH_Y@ * n], 0}, length = value[at[2] * n];
        const double weight = -m->opt.gravity[2] * row[@tables.DENSITY@];
        double exit[3], last[3], next[3];
        for (int k = 0; k < 3; k++) {
            exit[k] = d->xpos[3 * it->body + k] + value[(@geometry.LEVER_X@ + k) * n] - value[at[0] * n] * azimuth[k];
            exit[k] -= k == 2 ? value[at[1] * n] : 0;
            last[k] = row[@tables.FRAME_X@ + k];
        }
        if (!isfinite(exit[0] + exit[2] + value[@geometry.HORIZONTAL@ * n]))
            continue;
        if (row[@tables.PULLEY_RADIUS@] > 0)
            draw_line(scene, width, last, exit);
        memcpy(last, exit, sizeof last);
        for (int k = 1; k <= SHOWN; k++) {
            const double part = length * k / SHOWN;
            const @pair@ end = models_catenary_end(
                value[@geometry.HORIZONTAL@ * n], value[@geometry.VERTICAL@ * n] - weight * (length - part), part, weight, row[@tables.STIFFNESS@]);
            for (int j = 0; j < 3; j++)
                next[j] = exit[j] + end.f0 * azimuth[j] + (j == 2 ? end.f1 : 0);
            draw_line(scene, width, last, next);
            memcpy(last, next, sizeof last);
        }
    }
}

static int state_count(const mjModel *m, int instance)
{
    return STARTS * cable_count(m, instance);
}

static int sensor_count(const mjModel *m, int instance, int sensor)
{
    (void)sensor;
    return cable_count(m, instance);
}

mjPLUGIN_LIB_INIT(sagline_cables)
{
    static mjpPlugin plugin; /* all other callbacks are NULL */
    plugin.name = "sagline.cables";
    plugin.nattribute = ATTRIBUTES;
    plugin.attributes = attributes;
    plugin.capabilityflags = mjPLUGIN_PASSIVE | mjPLUGIN_ACTUATOR | mjPLUGIN_SENSOR;
    plugin.needstage = mjSTAGE_VEL;
    plugin.nstate = state_count;
    plugin.nsensordata = sensor_count;
    plugin.init = init;
    plugin.destroy = destroy;
    plugin.reset = reset;
    plugin.compute = compute;
    plugin.advance = advance;
    plugin.visualize = visualize;
    mjp_registerPlugin(&plugin);
}
