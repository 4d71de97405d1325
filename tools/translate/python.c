
/* Calls from Python. The values of an argument tuple become slots by a format, without a header or a library of Python:
   Python stores pointers to the functions of its stable interface in sagline_python.

   Format of an argument: f float, i integer, ? truth value, N None, (...) tuple; D2 array of double with 2 axes,
   L int64, B int8, F bool, Z complex. An array takes one slot for its data and one for each size; None takes none. */

typedef union {
    double f;
    int64_t i;
    void *p;
} Slot;

typedef struct {
    void *buf;
    void *obj;
    intptr_t len, itemsize;
    int readonly, ndim;
    char *format;
    intptr_t *shape, *strides, *suboffsets;
    void *internal;
} Buffer; /* Py_buffer, part of the stable interface since Python 3.11 */

typedef struct {
    int (*get_buffer)(void *object, Buffer *buffer, int flags);
    void (*release_buffer)(Buffer *buffer);
    intptr_t (*tuple_size)(void *tuple);
    void *(*tuple_item)(void *tuple, intptr_t index);
    double (*as_double)(void *object);
    int64_t (*as_integer)(void *object);
    int (*is_true)(void *object);
    void *(*error_occurred)(void);
    void (*clear_error)(void);
    void *(*release_lock)(void);
    void (*take_lock)(void *thread);
    void (*keep)(void *object);
    void *(*new_float)(double value);
    void *(*new_integer)(int64_t value);
    void *(*new_truth)(long value);
    void *(*fail)(void *kind, const char *format, ...);
    void *none, *value_error, *type_error;
} Python;

EXPORTED Python sagline_python;
static const Python *const python = &sagline_python;

enum { CONTIGUOUS_WITH_FORMAT = 0x20 | 0x10 | 0x08 | 0x04 }; /* PyBUF_C_CONTIGUOUS | PyBUF_FORMAT */

static bool is_little_endian(void) {
    const int32_t one = 1;
    return *(const char *)&one == 1;
}

static bool is_element(const Buffer *buffer, char kind) {
    const char *format = buffer->format ? buffer->format : "B";
    format += *format == (is_little_endian() ? '<' : '>'); /* numbers of a stated byte order, that of the processor */
    switch (kind) {
    case 'D': return format[0] == 'd' && format[1] == 0;
    case 'L': return (format[0] == 'l' || format[0] == 'q') && format[1] == 0 && buffer->itemsize == 8;
    case 'B': return format[0] == 'b' && format[1] == 0;
    case 'F': return format[0] == '?' && format[1] == 0;
    default: return format[0] == 'Z' && format[1] == 'd' && format[2] == 0;
    }
}

static bool fill_array(void *value, char kind, int rank, Slot **slots) {
    Buffer buffer;
    if (python->get_buffer(value, &buffer, CONTIGUOUS_WITH_FORMAT) != 0) return false;
    bool fits = buffer.ndim == rank && is_element(&buffer, kind);
    if (fits) {
        (*slots)++->p = buffer.buf;
        for (int axis = 0; axis < rank; axis++) (*slots)++->i = buffer.shape[axis];
    }
    python->release_buffer(&buffer);
    return fits;
}

/* Fills the slots of one value and moves the format behind it. */
static bool fill(void *value, const char **format, Slot **slots) {
    char kind = *(*format)++;
    switch (kind) {
    case 'N': return value == python->none;
    case 'f':
        if (value == python->none) return false;
        (*slots)->f = python->as_double(value);
        return (*slots)++->f != -1.0 || !python->error_occurred();
    case 'i':
        (*slots)->i = python->as_integer(value);
        return (*slots)++->i != -1 || !python->error_occurred();
    case '?':
        if (value == python->none) return false;
        (*slots)->i = python->is_true(value);
        return (*slots)++->i >= 0;
    case '(': {
        intptr_t size = python->tuple_size(value), count = 0;
        if (size < 0) return false;
        for (; **format != ')'; count++) {
            if (count >= size || !fill(python->tuple_item(value, count), format, slots)) return false;
        }
        (*format)++;
        return count == size;
    }
    default: return fill_array(value, kind, *(*format)++ - '0', slots);
    }
}

typedef struct {
    const char *name, *format; /* of the argument tuple */
    int (*call)(const Slot *slots, Slot *result);
    int64_t slots;
    char result; /* kind of the value that it returns; N: none */
} Entry;

enum { MOST_SLOTS = 256, WRONG_TYPES = -1 };

/* Slots of an argument tuple; 0, or WRONG_TYPES if its types are not those of the format. */
EXPORTED int sagline_fill(const Entry *entry, void *arguments, Slot *slots) {
    const char *format = entry->format;
    if (fill(arguments, &format, &slots)) return 0;
    python->clear_error();
    return WRONG_TYPES;
}

/* Code of an entry, which runs without Python's global lock; WRONG_TYPES if the types of the arguments are others. */
EXPORTED int sagline_call(const Entry *entry, void *arguments, Slot *result) {
    Slot slots[MOST_SLOTS];
    if (sagline_fill(entry, arguments, slots) != 0) return WRONG_TYPES;
    void *thread = python->release_lock();
    int code = entry->call(slots, result);
    python->take_lock(thread);
    return code;
}

typedef struct {
    const Entry *entry;
    const char *kinds; /* format of the last arguments, which are numbers */
    int64_t numbers;
    Slot *slots;
} Bound;

/* Function of Python (METH_FASTCALL): a kernel that keeps its slots, with other numbers as its last arguments at each
   call. `self`: tuple that begins with the address of a Bound. */
EXPORTED void *sagline_bound(void *self, void *const *arguments, intptr_t count) {
    const Bound *bound = (const Bound *)(intptr_t)python->as_integer(python->tuple_item(self, 0));
    const Entry *entry = bound->entry;
    const char *kinds = bound->kinds;
    Slot *slots = bound->slots + (entry->slots - bound->numbers), result;
    bool fits = count == bound->numbers;
    for (intptr_t k = 0; fits && k < count; k++) fits = fill(arguments[k], &kinds, &slots);
    if (!fits) {
        python->clear_error();
        return python->fail(python->type_error, "%s requires %d numbers", entry->name, (int)bound->numbers);
    }
    void *thread = python->release_lock();
    int code = entry->call(bound->slots, &result);
    python->take_lock(thread);
    if (code != 0) return python->fail(python->value_error, "work arrays of %s are too small for the sizes of its other arguments", entry->name);
    switch (entry->result) {
    case 'f': return python->new_float(result.f);
    case 'i': return python->new_integer(result.i);
    case '?': return python->new_truth((long)result.i);
    default: python->keep(python->none); return python->none;
    }
}

/* True if this processor has what the build for x86-64-v3 uses. */
EXPORTED int sagline_is_v3(void) {
#if defined(__GNUC__) && defined(__x86_64__)
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
#else
    return 0;
#endif
}
