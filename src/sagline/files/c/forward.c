
/* free motions without rotations; platform origin at which the centers of platform and frame anchors coincide */
static const sagline_real TRANSLATIONS[@translations_count@ * 6] = @translations@;
static const sagline_real MIDDLE[3] = @middle@;

static int solve(sagline_work *work, const sagline_real *freedom, int count, const sagline_real *length,
                 const sagline_real *wrench, sagline_real *pose, sagline_real *tension)
{
    sagline_real *rows = work->others, *factor = rows + @cable_rows@ * M, *last = factor + count * count;
    sagline_real *found = last + 13, *values = found + 7;
    int8_t *status = &work->statuses[M];
    *status = @not_converged@;
    @solve@(4, 0, 0, @behind@false, freedom, count, 6, BODY, 1, 5, CABLES, 1, M, 14, length, 1, M, pose, 1, 7, wrench, 1, 6,
            rows, @cable_rows@, M, factor, count, count, last, 13, work->numbers, @numbers@, work->counters, @counters@,
            found, 1, 7, work->results, @rows@, 1, M, work->statuses, 1, M, values, 1, 5, status, 1);
    for (int i = 0; i < 7 && *status != @not_converged@; i++)
        pose[i] = found[i];
    for (int i = 0; i < M && *status != @not_converged@; i++)
        tension[i] = work->results[5 * M + i];
    return *status > 0 ? *status + @offset@ : *status;
}

static bool are_lengths(const sagline_real *length)
{
    for (int i = 0; i < M; i++)
        if (!(length[i] > CABLES[14 * i + 12] && length[i] < (sagline_real)1e6))
            return false;
    return true;
}

int sagline_forward(sagline_work *work, const sagline_real length[M], const sagline_real *wrench, sagline_real pose[7],
                    sagline_real tension[M])
{
    const sagline_real *load = wrench != NULL ? wrench : NO_WRENCH;
    if (!are_lengths(length) || !is_finite(load, 6) || !is_pose(pose))
        return SAGLINE_BAD_INPUT;
    return solve(work, FREEDOM, N, length, load, pose, tension);
}

int sagline_search(sagline_work *work, const sagline_real length[M], const sagline_real *wrench, sagline_real pose[7],
                   sagline_real tension[M])
{
    const sagline_real *load = wrench != NULL ? wrench : NO_WRENCH;
    sagline_real start[7] = {MIDDLE[0], MIDDLE[1], MIDDLE[2], 0, 0, 0, 1}, mean = 0;
    if (!are_lengths(length) || !is_finite(load, 6))
        return SAGLINE_BAD_INPUT;
    for (int i = 0; i < M; i++)
        mean += length[i] / M;
    for (int k = 0; k < N; k++)
        for (int i = 0; i < 3; i++)
            start[i] -= @depth@ * mean * FREEDOM[6 * k + 2] * FREEDOM[6 * k + i];
    if (@translations_count@ < N) {
        if (solve(work, TRANSLATIONS, @translations_count@, length, load, start, tension) == SAGLINE_FORWARD_NOT_CONVERGED)
            return SAGLINE_FORWARD_NOT_CONVERGED;
    }
    const int status = solve(work, FREEDOM, N, length, load, start, tension);
    for (int i = 0; i < 7 && status != SAGLINE_FORWARD_NOT_CONVERGED; i++)
        pose[i] = start[i];
    return status;
}
