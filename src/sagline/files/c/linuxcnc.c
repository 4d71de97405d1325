
/* Pins: wrench on the platform [N, N m], tensions of the last inverse [N], status of the last call. */
static struct pins {
    hal_float_t *wrench[6], *tension[M];
    hal_s32_t *status;
} *pins;
static sagline_work work;
static int component;
static const double UNITS = @units@; /* machine units per meter */
static const double DEGREE = 0.017453292519943295;

static int report(int status)
{
    *pins->status = status;
    return status == SAGLINE_SOLVED ? 0 : -1;
}

static void read_wrench(double wrench[6])
{
    for (int k = 0; k < 6; k++)
        wrench[k] = *pins->wrench[k];
}

/* Pose of a world position: X, Y, Z and rotations by A, B, C [degrees] about the fixed axes x, y, z in this order. */
static void pose_of(const EmcPose *world, double pose[7])
{
    const double a = 0.5 * DEGREE * world->a, b = 0.5 * DEGREE * world->b, c = 0.5 * DEGREE * world->c;
    const double ca = cos(a), sa = sin(a), cb = cos(b), sb = sin(b), cc = cos(c), sc = sin(c);
    pose[0] = world->tran.x / UNITS;
    pose[1] = world->tran.y / UNITS;
    pose[2] = world->tran.z / UNITS;
    pose[3] = sa * cb * cc - ca * sb * sc;
    pose[4] = ca * sb * cc + sa * cb * sc;
    pose[5] = ca * cb * sc - sa * sb * cc;
    pose[6] = ca * cb * cc + sa * sb * sc;
}

/* The angle [degrees] of a sine and cosine, without a jump of a whole turn from the angle before. */
static double angle(double sine, double cosine, double before)
{
    const double found = atan2(sine, cosine) / DEGREE, turns = round((before - found) / 360.0);
    return isfinite(turns) ? found + 360.0 * turns : found;
}

static void to_world(const double pose[7], EmcPose *world)
{
    const double x = pose[3], y = pose[4], z = pose[5], w = pose[6];
    const double along_x = 1.0 - 2.0 * (y * y + z * z), along_y = 2.0 * (x * y + w * z);
    world->tran.x = UNITS * pose[0];
    world->tran.y = UNITS * pose[1];
    world->tran.z = UNITS * pose[2];
    world->a = angle(2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y), world->a);
    world->b = angle(2.0 * (w * y - x * z), hypot(along_x, along_y), world->b);
    world->c = angle(along_y, along_x, world->c);
}

KINEMATICS_TYPE kinematicsType(void) { return KINEMATICS_BOTH; }

int kinematicsInverse(const EmcPose *world, double *joints, const KINEMATICS_INVERSE_FLAGS *inverse_flags,
                      KINEMATICS_FORWARD_FLAGS *forward_flags)
{
    double pose[7], wrench[6], length[M], tension[M];
    (void)inverse_flags, (void)forward_flags;
    read_wrench(wrench);
    pose_of(world, pose);
    const int status = sagline_inverse(&work, 0, pose, wrench, NULL, length, tension);
    for (int i = 0; i < M && status == SAGLINE_SOLVED; i++) {
        joints[i] = UNITS * length[i];
        *pins->tension[i] = tension[i];
    }
    return report(status);
}

/* The solution begins at the given world position; the first one, and one that fails, in the middle of the frame. */
int kinematicsForward(const double *joints, EmcPose *world, const KINEMATICS_FORWARD_FLAGS *forward_flags,
                      KINEMATICS_INVERSE_FLAGS *inverse_flags)
{
    static bool known;
    double pose[7], wrench[6], length[M], tension[M];
    (void)forward_flags, (void)inverse_flags;
    read_wrench(wrench);
    pose_of(world, pose);
    for (int i = 0; i < M; i++)
        length[i] = joints[i] / UNITS;
    int status = known ? sagline_forward(&work, length, wrench, pose, tension) : SAGLINE_FORWARD_NOT_CONVERGED;
    if (status != SAGLINE_SOLVED)
        status = sagline_search(&work, length, wrench, pose, tension);
    if (status == SAGLINE_SOLVED) {
        known = true;
        to_world(pose, world);
    }
    return report(status);
}

EXPORT_SYMBOL(kinematicsType);
EXPORT_SYMBOL(kinematicsForward);
EXPORT_SYMBOL(kinematicsInverse);
#ifdef KINS_NOT_SWITCHABLE
KINS_NOT_SWITCHABLE
#endif
MODULE_AUTHOR("sagline");
MODULE_DESCRIPTION("kinematics of the cable-driven parallel robot @name@");
MODULE_LICENSE("Dual MIT/GPL");

static int make_pins(void)
{
    int failed = hal_pin_s32_newf(HAL_OUT, &pins->status, component, "@module@.status");
    for (int k = 0; k < 6 && !failed; k++)
        failed = hal_pin_float_newf(HAL_IN, &pins->wrench[k], component, "@module@.%s-%c", k < 3 ? "force" : "moment",
                                    "xyz"[k % 3]);
    for (int i = 0; i < M && !failed; i++)
        failed = hal_pin_float_newf(HAL_OUT, &pins->tension[i], component, "@module@.tension-%d", i);
    return failed;
}

int rtapi_app_main(void)
{
    component = hal_init("@module@");
    if (component < 0)
        return component;
    pins = hal_malloc(sizeof *pins);
    const int failed = pins == NULL ? -1 : make_pins();
    if (failed) {
        hal_exit(component);
        return failed;
    }
    return hal_ready(component);
}

void rtapi_app_exit(void) { hal_exit(component); }
