/* Steps as a call of XLA, by its C interface: what is to be done stands in two numbers, the address
   of the function that maps a stepper's steps and that of what they have in common. */
#include "xla/ffi/api/c_api.h"

#include <stddef.h>
#include <stdint.h>
#include <string.h>

typedef int map_steps(const void *of, int n, const double *q, const double *v, const double *u,
                      const double *par, double *q_end, double *v_end, double *slopes);

static XLA_FFI_Error *say(const XLA_FFI_CallFrame *frame, const char *message) {
    XLA_FFI_Error_Create_Args error;
    memset(&error, 0, sizeof error);
    error.struct_size = XLA_FFI_Error_Create_Args_STRUCT_SIZE;
    error.message = message;
    error.errc = XLA_FFI_Error_Code_INVALID_ARGUMENT;
    return frame->api->XLA_FFI_Error_Create(&error);
}

static int64_t number(const XLA_FFI_CallFrame *frame, const char *name) {
    int64_t k;
    for (k = 0; k < frame->attrs.size; ++k) {
        const XLA_FFI_ByteSpan *own = frame->attrs.names[k];
        if (own->len == strlen(name) && memcmp(own->ptr, name, own->len) == 0) {
            const XLA_FFI_Scalar *scalar = frame->attrs.attrs[k];
            int64_t value;
            memcpy(&value, scalar->value, sizeof value);
            return value;
        }
    }
    return 0;
}

/* (q, v, u, par) -> (q_next, v_next), or with the derivatives behind them. */
XLA_FFI_Error *signorini_steps(XLA_FFI_CallFrame *frame) {
    const double *from[4];
    double *to[3] = {NULL, NULL, NULL};
    int64_t n = 1;
    int64_t k;
    map_steps *map;
    int failed;
    if (frame->extension_start != NULL &&
        frame->extension_start->type == XLA_FFI_Extension_Metadata) {
        XLA_FFI_Metadata *about =
            ((XLA_FFI_Metadata_Extension *)(void *)frame->extension_start)->metadata;
        about->api_version.major_version = XLA_FFI_API_MAJOR;
        about->api_version.minor_version = XLA_FFI_API_MINOR;
        return NULL;
    }
    if (frame->args.size != 4 || frame->rets.size < 2 || frame->rets.size > 3) {
        return say(frame, "signorini: a step has four arguments and two or three results");
    }
    for (k = 0; k < 4; ++k) {
        const XLA_FFI_Buffer *buffer = frame->args.args[k];
        from[k] = buffer->data;
        if (buffer->dtype != XLA_FFI_DataType_F64) {
            return say(frame, "signorini: steps are of double precision");
        }
        if (k == 0) {
            int64_t i;
            for (i = 0; i + 1 < buffer->rank; ++i) {
                n *= buffer->dims[i];
            }
        }
    }
    for (k = 0; k < frame->rets.size; ++k) {
        to[k] = ((XLA_FFI_Buffer *)frame->rets.rets[k])->data;
    }
    {
        const int64_t address = number(frame, "function");
        memcpy(&map, &address, sizeof map);
    }
    failed = map((const void *)(intptr_t)number(frame, "common"), (int)n, from[0], from[1], from[2],
                 from[3], to[0], to[1], to[2]);
    return failed == 0 ? NULL : say(frame, "signorini: a step cannot be taken");
}
