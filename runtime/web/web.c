/* One model in a page: the functions that JavaScript calls, and the numbers that it reads and
   writes. A page has one model, so that its memory stands here. */
#include "web_model.h"

#ifdef __wasm__
#define WEB_CALLED(name) __attribute__((export_name(#name)))
#else
#define WEB_CALLED(name)
#endif

/* A function of the model at the present moment. */
#define WEB_EVALUATE(what, out) \
    web_evaluate_##what(web_now.t, web_now.q, web_now.v, web_numbers_u, &web_params, out)

static M(state) web_now;
static M(work) web_work;
static M(info) web_info;
static M(params) web_params;
static M(options) web_options;
static double web_numbers_q[WEB_N_Q], web_numbers_v[WEB_N_Q];
static double web_numbers_u[WEB_N_U + 1];
static double web_numbers_points[WEB_N_POINTS + 1], web_numbers_gaps[WEB_N_N + 1];
static double web_numbers_outputs[WEB_N_OUTPUTS + 1];

/* Parameters, inputs, the start that is to be: read and written. */
WEB_CALLED(parameters) double *web_parameters(void) { return (double *)(void *)&web_params; }
WEB_CALLED(inputs) double *web_inputs(void) { return web_numbers_u; }
WEB_CALLED(start_q) double *web_start_q(void) { return web_numbers_q; }
WEB_CALLED(start_v) double *web_start_v(void) { return web_numbers_v; }

/* What the last step has led to: read. */
WEB_CALLED(time) double web_time(void) { return web_now.t; }
WEB_CALLED(q) const double *web_q(void) { return web_now.q; }
WEB_CALLED(v) const double *web_v(void) { return web_now.v; }
WEB_CALLED(percussions) const double *web_percussions(void) { return web_info.P; }
WEB_CALLED(states) const int *web_states(void) { return web_info.contact; }
WEB_CALLED(impacts) const int *web_impacts(void) { return web_info.impacts; }
WEB_CALLED(iterations) int web_iterations(void) { return web_info.iterations; }

WEB_CALLED(energy) double web_energy(void) {
    double out[1];
    WEB_EVALUATE(energy, out);
    return out[0];
}

WEB_CALLED(gaps) const double *web_gaps(void) {
    WEB_EVALUATE(gaps, web_numbers_gaps);
    return web_numbers_gaps;
}

WEB_CALLED(outputs) const double *web_outputs(void) {
    WEB_EVALUATE(outputs, web_numbers_outputs);
    return web_numbers_outputs;
}

WEB_CALLED(points) const double *web_points(void) {
    WEB_EVALUATE(points, web_numbers_points);
    return web_numbers_points;
}

/* The start that the model has for the present parameters. */
WEB_CALLED(suggest) void web_suggest(void) {
    double t;
    M(initial_state)(&web_params, &t, web_numbers_q, web_numbers_v);
}

/* Everything as the model has it. */
WEB_CALLED(defaults) void web_defaults(void) {
    int k;
    web_params = M(default_params)();
    web_options = M(default_options)();
    web_options.max_halvings = 4;
#if WEB_LOCATED
    web_options.events = WEB_EVENTS_LOCATED;
#endif
    for (k = 0; k < WEB_N_U; ++k) {
        web_numbers_u[k] = 0.0;
    }
    web_suggest();
}

/* Begin at the start that is set; returns a status. */
WEB_CALLED(begin) int web_begin(void) {
    double t, q[WEB_N_Q], v[WEB_N_Q];
    int k;
    M(initial_state)(&web_params, &t, q, v);
    for (k = 0; k < WEB_N_R; ++k) {
        web_info.P[k] = 0.0;
    }
    for (k = 0; k < WEB_N_CONTACTS; ++k) {
        web_info.contact[k] = WEB_UNKNOWN;
        web_info.impacts[k] = 0;
    }
    return M(init)(&web_now, &web_params, &web_options, t, web_numbers_q, web_numbers_v);
}

/* One step; returns a status. A step that fails leaves the state as it was. */
WEB_CALLED(step) int web_step(double dt) {
    return M(step)(&web_now, &web_work, &web_info, &web_params, &web_options, web_numbers_u, dt);
}
