#define M SAGLINE_CABLES
#define N SAGLINE_FREEDOMS

/* free motions of the platform; mass, gravity, center of mass; rows of the cables: frame anchor, platform anchor, mass
 * per length, EA, limits of the tension, pulley radius, side of its entry, dead length, rise of the dead length */
static const sagline_real FREEDOM[N * 6] = @freedom@;
static const sagline_real BODY[5] = @body@;
static const sagline_real CABLES[M * 14] = @table@;
static const struct {
    int code;
    sagline_real parameter, validity;
    int variable;
    sagline_real weights[M], targets[M];
} METHODS[SAGLINE_METHODS] = {@rules@};
static const sagline_real NO_WRENCH[6] = {0};

static bool is_finite(const sagline_real *values, int count)
{
    for (int i = 0; i < count; i++)
        if (!isfinite(values[i]))
            return false;
    return true;
}

static bool is_pose(const sagline_real *pose)
{
    sagline_real square = 0;
    for (int i = 3; i < 7; i++)
        square += pose[i] * pose[i];
    return is_finite(pose, 7) && square > (sagline_real)0.999998 && square < (sagline_real)1.000002;
}

int sagline_inverse(sagline_work *work, int method, const sagline_real pose[7], const sagline_real *wrench,
                    sagline_real *previous, sagline_real length[M], sagline_real tension[M])
{
    const sagline_real *load = wrench != NULL ? wrench : NO_WRENCH;
    sagline_real *residuals = work->others, *needed = residuals + 2, *nearby = needed + N;
    int8_t *status = &work->statuses[M];
    if (method < 0 || method >= SAGLINE_METHODS || !is_pose(pose) || !is_finite(load, 6))
        return SAGLINE_BAD_INPUT;
    for (int i = 0; i < M; i++)
        nearby[i] = previous != NULL ? previous[i] : NAN;
    *status = SAGLINE_NOT_CONVERGED; /* if the work memory were too small, the kernel would leave it so */
    @inverse@(4, 0, 0, METHODS[method].code, METHODS[method].parameter, METHODS[method].variable,
              METHODS[method].weights, M, METHODS[method].targets, M, @limits_of@, METHODS[method].validity, FREEDOM, N, 6,
              BODY, 1, 5, CABLES, 1, M, 14, pose, 1, 7, load, 1, 6, nearby, M, work->numbers, @numbers@, work->counters,
              @counters@, @otherwise@work->results, @rows@, 1, M, work->statuses, 1, M, residuals, 1, 2, needed, 1, N,
              status, 1, 0, 1);
    for (int i = 0; i < M && *status == SAGLINE_SOLVED; i++) {
        length[i] = work->results[2 * M + i];
        tension[i] = work->results[5 * M + i];
        if (previous != NULL)
            previous[i] = nearby[i];
    }
    return *status;
}
