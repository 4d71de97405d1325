
/* Calls from XLA, the compiler of JAX, through the C interface of its foreign functions. Only the parts of the
   structures that are used here are declared; later versions only append members.

   One function calls every entry. Attributes: name and format of the entry; plan, one letter per array of the format:
   a argument, r result, s work array; sizes of the work arrays; numbers, the values of all numbers. An argument or
   result with more axes than the format has leading axes of a batch, of which an argument may have size 1. */

typedef struct {
    size_t size;
    void *next;
} XlaHead;

typedef struct {
    XlaHead head;
    int major, minor;
} XlaVersion;

typedef struct {
    XlaHead head;
    const char *message;
    int code;
} XlaError;

typedef struct {
    XlaHead head;
    XlaVersion version;
    const void *internal;
    void *(*create_error)(XlaError *error);
} XlaInterface;

typedef struct {
    size_t size;
    XlaVersion version;
    uint32_t traits;
} XlaMetadata;

typedef struct {
    size_t size;
    int type;
    void *next;
    XlaMetadata *metadata;
} XlaExtension;

typedef struct {
    XlaHead head;
    int type;
    void *data;
    int64_t rank;
    int64_t *sizes;
} XlaBuffer;

typedef struct {
    XlaHead head;
    int64_t count;
    int *types;
    void **items;
} XlaList;

typedef struct {
    const char *text;
    size_t length;
} XlaText;

typedef struct {
    XlaHead head;
    int64_t count;
    int *types;
    XlaText **names;
    void **items;
} XlaAttributes;

typedef struct {
    int type;
    size_t count;
    const void *values;
} XlaNumbers;

typedef struct {
    XlaHead head;
    const XlaInterface *interface;
    void *context;
    int stage;
    XlaList arguments, results;
    XlaAttributes attributes;
} XlaCall;

enum { XLA_INVALID = 3, XLA_METADATA = 1, XLA_S8 = 2, XLA_S64 = 5, XLA_F64 = 12, XLA_ARRAY = 1, XLA_TEXT = 4 };
enum { XLA_MOST = 64, XLA_AXES = 8 };

typedef struct {
    int slot;            /* of its pointer */
    char *data;
    int64_t bytes;       /* of one item of the batch */
    int64_t axes;        /* leading axes */
    const int64_t *sizes;
} XlaItem;

static void *xla_error(const XlaCall *call, const char *message) {
    XlaError error = {{sizeof(XlaError), 0}, message, XLA_INVALID};
    return call->interface->create_error(&error);
}

static bool is_same_text(const XlaText *text, const char *other) {
    size_t k = 0;
    while (k < text->length && other[k] == text->text[k] && other[k]) k++;
    return k == text->length && other[k] == 0;
}

static const void *xla_attribute(const XlaCall *call, const char *name, int type) {
    for (int64_t k = 0; k < call->attributes.count; k++) {
        if (is_same_text(call->attributes.names[k], name) && call->attributes.types[k] == type)
            return call->attributes.items[k];
    }
    return 0;
}

/* Moves the pointers of all items to number `index` of a batch with the leading `sizes`. */
static void place_items(const XlaItem *items, int count, int64_t axes, const int64_t *sizes, int64_t index, Slot *slots) {
    for (int k = 0; k < count; k++) {
        int64_t offset = 0, stride = 1, rest = index;
        for (int64_t axis = axes - 1; axis >= 0; axis--) {
            int64_t own = axis - (axes - items[k].axes), at = rest % sizes[axis];
            rest /= sizes[axis];
            if (own < 0) continue;
            offset += items[k].sizes[own] == 1 ? 0 : at * stride;
            stride *= items[k].sizes[own];
        }
        slots[items[k].slot].p = items[k].data + offset * items[k].bytes;
    }
}

EXPORTED void *sagline_xla(const XlaCall *call) {
    XlaExtension *asked = call->head.next;
    if (asked && asked->type == XLA_METADATA) { /* the structures are those of all minor versions of version 0 */
        asked->metadata->version.major = 0;
        asked->metadata->version.minor = call->interface ? call->interface->version.minor : 0;
        asked->metadata->traits = 0;
        return 0;
    }
    const XlaText *name = xla_attribute(call, "entry", XLA_TEXT), *form = xla_attribute(call, "format", XLA_TEXT);
    const XlaText *plan = xla_attribute(call, "plan", XLA_TEXT);
    const XlaNumbers *sizes = xla_attribute(call, "sizes", XLA_ARRAY), *numbers = xla_attribute(call, "numbers", XLA_ARRAY);
    if (!name || !form || !plan || !sizes || !numbers || sizes->type != XLA_S64 || numbers->type != XLA_F64)
        return xla_error(call, "an attribute of a call of sagline is missing");
    const Entry *entry = sagline_entries;
    while (entry->name && !(is_same_text(name, entry->name) && is_same_text(form, entry->format))) entry++;
    if (!entry->name) return xla_error(call, "the library of sagline has no such entry");
    Slot slots[MOST_SLOTS], result;
    XlaItem items[XLA_MOST];
    int filled = 0, count = 0;
    int64_t argument = 0, output = 0, number = 0, work = 0, letter = 0, axes = 0, bytes[XLA_MOST] = {0};
    const int64_t *batch = 0;
    for (const char *kind = entry->format; *kind; kind++) {
        if (*kind == '(' || *kind == ')' || *kind == 'N') continue;
        if (*kind == 'f' || *kind == 'i' || *kind == '?') {
            if (number >= (int64_t)numbers->count) return xla_error(call, "too few numbers");
            double value = ((const double *)numbers->values)[number++];
            if (*kind == 'f') slots[filled++].f = value;
            else slots[filled++].i = (int64_t)value;
            continue;
        }
        int64_t rank = kind[1] - '0', width = *kind == 'B' ? 1 : 8;
        char role = letter < (int64_t)plan->length ? plan->text[letter++] : 0;
        if (count >= XLA_MOST) return xla_error(call, "too many arrays");
        XlaItem *item = &items[count];
        item->slot = filled++;
        item->bytes = width;
        item->axes = 0;
        item->data = 0;
        const int64_t *own = 0;
        if (role == 's') {
            if (work + rank > (int64_t)sizes->count) return xla_error(call, "too few sizes");
            own = (const int64_t *)sizes->values + work;
            work += rank;
        } else {
            const XlaList *list = role == 'a' ? &call->arguments : &call->results;
            int64_t *next = role == 'a' ? &argument : &output;
            if (*next >= list->count) return xla_error(call, "too few arrays");
            const XlaBuffer *buffer = list->items[(*next)++];
            int type = *kind == 'D' ? XLA_F64 : *kind == 'L' ? XLA_S64 : XLA_S8;
            if (buffer->type != type || buffer->rank < rank || buffer->rank - rank > XLA_AXES)
                return xla_error(call, "an array has another type or fewer axes than the entry");
            item->axes = buffer->rank - rank;
            item->data = buffer->data;
            item->sizes = buffer->sizes;
            own = buffer->sizes + item->axes;
            if (role == 'r') axes = item->axes, batch = buffer->sizes;
        }
        for (int64_t axis = 0; axis < rank; axis++) {
            item->bytes *= own[axis];
            slots[filled++].i = own[axis];
        }
        bytes[count] = role == 's' ? item->bytes : 0;
        count++;
        kind++;
    }
    int64_t total = 0, calls = 1, code = 0;
    for (int k = 0; k < count; k++) total += (bytes[k] + 15) / 16 * 16;
    for (int64_t axis = 0; axis < axes; axis++) calls *= batch[axis];
    char *memory = malloc(total ? (size_t)total : 1), *place = memory;
    if (!memory) return xla_error(call, "no memory");
    for (int k = 0; k < count; k++) {
        if (bytes[k]) items[k].data = place;
        place += (bytes[k] + 15) / 16 * 16;
    }
    for (int64_t index = 0; index < calls && !code; index++) {
        place_items(items, count, axes, batch, index, slots);
        code = entry->call(slots, &result);
    }
    free(memory);
    return code ? xla_error(call, "work arrays of an entry are too small") : 0;
}
