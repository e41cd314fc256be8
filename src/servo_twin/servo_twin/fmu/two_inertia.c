/* Two inertias on a spring, or, with -DRIGID, one, as a co-simulation FMU of FMI 2 or 3
 * (-DFMI_VERSION). One step of semi-implicit Euler a call. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#if FMI_VERSION == 2
#include "fmi2Functions.h"
#define OK fmi2OK
#define ERROR fmi2Error
#define STATUS fmi2Status
#define REFERENCE fmi2ValueReference
#else
#include "fmi3Functions.h"
#define OK fmi3OK
#define ERROR fmi3Error
#define STATUS fmi3Status
#define REFERENCE fmi3ValueReference
#endif

enum { TAU_M, TAU_EXT, PHI_M, W_M, PHI_L, W_L, TAU, J_M, J_L, RATIO, C, D,
       PHI_M0, W_M0, PHI_L0, W_L0, FAIL_AT, COUNT };

typedef struct {
    double v[COUNT];
#if FMI_VERSION == 2
    fmi2CallbackFunctions calls;
#else
    fmi3LogMessageCallback log;
    fmi3InstanceEnvironment environment;
#endif
} Model;

static void begin(Model *m)
{
    memset(m->v, 0, sizeof m->v);
    m->v[J_M] = 1e-3, m->v[J_L] = 0.5, m->v[RATIO] = 20.0, m->v[C] = 4e3, m->v[D] = 2.0;
    m->v[FAIL_AT] = 1e9;
}

static double torque(const double *v)
{
    return v[C] * (v[PHI_M] / v[RATIO] - v[PHI_L]) + v[D] * (v[W_M] / v[RATIO] - v[W_L]);
}

static void initialised(Model *m)
{
    memcpy(m->v + PHI_M, m->v + PHI_M0, 4 * sizeof(double));
#ifdef RIGID
    m->v[PHI_L] = m->v[PHI_M] / m->v[RATIO], m->v[W_L] = m->v[W_M] / m->v[RATIO];
#endif
}

static void step(double *v, double h)
{
#ifdef RIGID
    double inertia = v[J_M] + v[J_L] / (v[RATIO] * v[RATIO]);
    v[W_M] += h / inertia * (v[TAU_M] - v[TAU_EXT] / v[RATIO]);
    v[PHI_M] += h * v[W_M];
    v[W_L] = v[W_M] / v[RATIO], v[PHI_L] = v[PHI_M] / v[RATIO];
#else
    double t = torque(v);
    v[W_M] += h / v[J_M] * (v[TAU_M] - t / v[RATIO]);
    v[PHI_M] += h * v[W_M];
    v[W_L] += h / v[J_L] * (t - v[TAU_EXT]);
    v[PHI_L] += h * v[W_L];
#endif
}

static double value(const Model *m, REFERENCE r) { return r == TAU ? torque(m->v) : m->v[r]; }

#if FMI_VERSION == 2
static STATUS advance(Model *m, double t, double h)
{
    if (t >= m->v[FAIL_AT]) {
        m->calls.logger(m->calls.componentEnvironment, "screw", ERROR, "logStatusError",
                        "the nut ran off its thread at %g rad", m->v[PHI_L]);
        return ERROR;
    }
    step(m->v, h);
    return OK;
}

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String s[])
{ return OK; }
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String place,
                              const fmi2CallbackFunctions *calls, fmi2Boolean v, fmi2Boolean l)
{
    if (type != fmi2CoSimulation || strcmp(guid, "{servo-twin-example}")) return NULL;
    Model *m = calloc(1, sizeof *m);
    begin(m);
    m->calls = *calls;
    return m;
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean a, fmi2Real b, fmi2Real t,
                               fmi2Boolean e, fmi2Real f) { return OK; }
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { initialised(c); return OK; }
fmi2Status fmi2Terminate(fmi2Component c) { return OK; }
fmi2Status fmi2Reset(fmi2Component c) { begin(c); return OK; }
fmi2Status fmi2GetReal(fmi2Component c, const REFERENCE r[], size_t n, fmi2Real x[])
{ for (size_t i = 0; i < n; i++) x[i] = value(c, r[i]); return OK; }
fmi2Status fmi2SetReal(fmi2Component c, const REFERENCE r[], size_t n, const fmi2Real x[])
{ for (size_t i = 0; i < n; i++) ((Model *)c)->v[r[i]] = x[i]; return OK; }
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *s)
{ *s = memcpy(malloc(sizeof(Model)), c, sizeof(Model)); return OK; }
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate s)
{ memcpy(c, s, sizeof(Model)); return OK; }
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *s) { free(*s); *s = NULL; return OK; }
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean forget)
{ return advance(c, t, h); }
#else
static STATUS advance(Model *m, double t, double h)
{
    if (t >= m->v[FAIL_AT]) {
        char text[80];
        snprintf(text, sizeof text, "the nut ran off its thread at %g rad", m->v[PHI_L]);
        m->log(m->environment, ERROR, "logStatusError", text);
        return ERROR;
    }
    step(m->v, h);
    return OK;
}

const char *fmi3GetVersion(void) { return "3.0"; }
fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String s[])
{ return OK; }
fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String place, fmi3Boolean v, fmi3Boolean l,
    fmi3Boolean e, fmi3Boolean r, const fmi3ValueReference q[], size_t n,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3IntermediateUpdateCallback update)
{
    if (strcmp(token, "{servo-twin-example}")) return NULL;
    Model *m = calloc(1, sizeof *m);
    begin(m);
    m->log = log, m->environment = environment;
    return m;
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean a, fmi3Float64 b,
                                       fmi3Float64 t, fmi3Boolean e, fmi3Float64 f)
{ return OK; }
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { initialised(c); return OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { return OK; }
fmi3Status fmi3Reset(fmi3Instance c) { begin(c); return OK; }
fmi3Status fmi3GetFloat64(fmi3Instance c, const REFERENCE r[], size_t n, fmi3Float64 x[],
                          size_t width)
{
    if (n != width) return ERROR;
    for (size_t i = 0; i < n; i++) x[i] = value(c, r[i]);
    return OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const REFERENCE r[], size_t n, const fmi3Float64 x[],
                          size_t width)
{
    if (n != width) return ERROR;
    for (size_t i = 0; i < n; i++) ((Model *)c)->v[r[i]] = x[i];
    return OK;
}
fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *s)
{ *s = memcpy(malloc(sizeof(Model)), c, sizeof(Model)); return OK; }
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState s)
{ memcpy(c, s, sizeof(Model)); return OK; }
fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *s) { free(*s); *s = NULL; return OK; }
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean forget,
                      fmi3Boolean *event, fmi3Boolean *ends, fmi3Boolean *early,
                      fmi3Float64 *last)
{
    *event = *ends = *early = 0, *last = t + h;
    return advance(c, t, h);
}
#endif
