/* FMI 3.0 on one program of flat arrays, which Python runs (resources/runtime.py).

The numbers of an instance lie in one block: z = (time, states, inputs, parameters, hidden coordinates), its results
(rates of the states, outputs, hidden coordinates, gap), and a pair of vectors for derivatives.  Value references are
places: k < NUM_Z is z[k], NUM_Z + k is results[k].  Python sees the block through a memory view, so that a call has no
arguments.  In a Python process its interpreter serves; elsewhere the library that exported the file is loaded.
sizes.h: NUM_X, NUM_U, NUM_P, NUM_Y, NUM_HIDDEN, IS_ME, HAS_ENDS, TOKEN, PYTHON_LIBRARY, PYTHON_PROGRAM, PYTHON_VERSION. */

#define _GNU_SOURCE
#include "sizes.h"
#include <dlfcn.h>
#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <wchar.h>

#define NUM_KNOWN (1 + NUM_X + NUM_U + NUM_P)
#define NUM_Z (NUM_KNOWN + NUM_HIDDEN)
#define NUM_UNKNOWN (NUM_X + NUM_Y)
#define NUM_RESULTS (NUM_UNKNOWN + NUM_HIDDEN + 1)
#define NUM_SEED (NUM_KNOWN > NUM_UNKNOWN ? NUM_KNOWN : NUM_UNKNOWN)
#define NUM_BLOCK (NUM_Z + NUM_RESULTS + 2 * NUM_SEED + NUM_X)
#define MESSAGE 2048

/* Declarations of FMI 3.0 (fmi-standard.org, functions and types as its headers have them). */
typedef void *Instance, *Environment, *State;
typedef uint32_t Ref;
typedef enum { OK, Warning, Discard, Error, Fatal } Status;
typedef void (*Log)(Environment, Status, const char *category, const char *message);
#define FMI __attribute__((visibility("default")))

typedef struct {
    double block[NUM_BLOCK];
    char message[MESSAGE];
    char *name;
    double start[NUM_Z]; /* z of a new instance */
    bool is_current;     /* the results are those of z */
    bool is_co_simulation;
    Environment environment;
    Log log;
    void *python; /* the object of runtime.py */
} Model;

/* The two vectors of derivatives lie behind the results, and behind them the nominal values of the states. */
static double *z_of(Model *m) { return m->block; }
static double *results_of(Model *m) { return m->block + NUM_Z; }
static double *seed_of(Model *m) { return results_of(m) + NUM_RESULTS; }
static double *sensitivity_of(Model *m) { return seed_of(m) + NUM_SEED; }
static double *nominals_of(Model *m) { return sensitivity_of(m) + NUM_SEED; }

static Status fail(Model *m, Status status, const char *message) {
    if (m->log) m->log(m->environment, status, status == Discard ? "logStatusDiscard" : "logStatusError", message);
    return status;
}

/* Python, by the names of its stable interface: no header of it is needed, and any version serves. */
static struct {
    int (*is_initialised)(void);
    void (*initialise)(int);
    void *(*save_thread)(void);
    int (*ensure)(void);
    void (*release)(int);
    void *(*import)(const char *);
    void *(*call_method)(void *, const char *, const char *, ...);
    void *(*item)(void *, const char *);
    void *(*call)(void *, const char *, ...);
    void *(*view)(char *, intptr_t, int);
    long (*as_long)(void *);
    void (*decref)(void *);
    void (*print_error)(void);
} py;
static char why_not[MESSAGE];
static pthread_mutex_t start_lock = PTHREAD_MUTEX_INITIALIZER;

static bool load_symbols(void *library) {
#define LOAD(field, symbol) if (!(*(void **)&py.field = dlsym(library, symbol))) return false
    LOAD(is_initialised, "Py_IsInitialized");
    LOAD(initialise, "Py_InitializeEx");
    LOAD(save_thread, "PyEval_SaveThread");
    LOAD(ensure, "PyGILState_Ensure");
    LOAD(release, "PyGILState_Release");
    LOAD(import, "PyImport_ImportModule");
    LOAD(call_method, "PyObject_CallMethod");
    LOAD(item, "PyDict_GetItemString");
    LOAD(call, "PyObject_CallFunction");
    LOAD(view, "PyMemoryView_FromMemory");
    LOAD(as_long, "PyLong_AsLong");
    LOAD(decref, "Py_DecRef");
    LOAD(print_error, "PyErr_Print");
    return true;
}

/* A new interpreter is told the program of the one that exported, so that it finds the same packages. */
static void start_interpreter(void *library, const char *program) {
    static wchar_t wide[4096];
    void *(*create)(void) = dlsym(library, "PyInitConfig_Create");
    int (*set)(void *, const char *, const char *) = dlsym(library, "PyInitConfig_SetStr");
    int (*run)(void *) = dlsym(library, "Py_InitializeFromInitConfig");
    void (*set_name)(const wchar_t *) = dlsym(library, "Py_SetProgramName");
    if (create && set && run) {
        void *config = create();
        if (config && !set(config, "program_name", program) && !run(config)) return;
    }
    if (set_name && mbstowcs(wide, program, 4095) != (size_t)-1) set_name(wide);
    py.initialise(0);
}

static bool start_python(void) {
    static bool is_ready = false;
    pthread_mutex_lock(&start_lock);
    if (!is_ready && !(load_symbols(RTLD_DEFAULT) && py.is_initialised())) {
        const char *path = getenv("JAXMBS_FMU_LIBPYTHON"), *program = getenv("JAXMBS_FMU_PYTHON");
        void *library = dlopen(path ? path : PYTHON_LIBRARY, RTLD_NOW | RTLD_GLOBAL);
        if (!library || !load_symbols(library)) {
            const char *reason = dlerror();
            snprintf(why_not, MESSAGE,
                     "this FMU runs Python %s, whose library cannot be loaded (%s): name it in the environment variable "
                     "JAXMBS_FMU_LIBPYTHON, and a program python that has jax in JAXMBS_FMU_PYTHON",
                     PYTHON_VERSION, reason ? reason : "it has no Python in it");
            pthread_mutex_unlock(&start_lock);
            return false;
        }
        if (!py.is_initialised()) {
            start_interpreter(library, program ? program : PYTHON_PROGRAM);
            py.save_thread(); /* the lock of the interpreter is free: every call takes it */
        }
    }
    is_ready = true;
    pthread_mutex_unlock(&start_lock);
    return true;
}

/* A method of the Python side without arguments: its message, if it has one, is logged with the status it returns. */
static Status ask(Model *m, const char *method) {
    int lock = py.ensure();
    void *found = py.call_method(m->python, method, NULL);
    long status = found ? py.as_long(found) : Fatal;
    if (found) py.decref(found); else py.print_error();
    py.release(lock);
    return status == OK ? OK : fail(m, (Status)status, found ? m->message : "runtime.py failed");
}

static Status evaluate(Model *m) {
    if (m->is_current) return OK;
    Status status = ask(m, "evaluate");
    m->is_current = status == OK;
    return status;
}

/* The hidden coordinates of closed loops that were found become those from where the next search begins. */
static Status accept(Model *m) {
    if (!NUM_HIDDEN) return OK;
    Status status = evaluate(m);
    if (status == OK) memcpy(z_of(m) + NUM_KNOWN, results_of(m) + NUM_UNKNOWN, NUM_HIDDEN * sizeof(double));
    return status;
}

/* What the host keeps as a point of the motion: discarded where a part of the model is beyond the end of its range.
   Rates are given there, as the stages of a step may try such points. */
static Status take(Model *m) {
    Status status = accept(m);
    return status == OK && HAS_ENDS && !m->is_co_simulation ? ask(m, "judge") : status;
}

static void put(Model *m, size_t place, double value) {
    double *x = z_of(m) + place;
    if (*x == value) return;
    *x = value;
    m->is_current = false;
}

static Model *instantiate(const char *name, const char *token, const char *resources, Environment environment, Log log,
                          bool is_co_simulation) {
    Model *m = calloc(1, sizeof(Model));
    if (!m) return NULL;
    m->environment = environment, m->log = log, m->is_co_simulation = is_co_simulation;
    m->name = strdup(name ? name : "");
    const char *fault = NULL;
    if (!token || strcmp(token, TOKEN)) fault = "the instantiation token is not that of this FMU";
    else if (!resources) fault = "the path of the resources is missing";
    else if (!start_python()) fault = why_not;
    if (!fault) {
        char path[4096];
        size_t length = strlen(resources);
        const char *slash = length && resources[length - 1] == '/' ? "" : "/";
        snprintf(path, sizeof path, "%s%sruntime.py", resources, slash);
        int lock = py.ensure();
        void *runpy = py.import("runpy");
        void *names = runpy ? py.call_method(runpy, "run_path", "s", path) : NULL;
        void *open = names ? py.item(names, "open_instance") : NULL;
        void *block = py.view((char *)m->block, sizeof m->block, 0x200), *text = py.view(m->message, MESSAGE, 0x200);
        m->python = open && block && text ? py.call(open, "sOOi", resources, block, text, (int)is_co_simulation) : NULL;
        if (!m->python) py.print_error();
        for (void **used = (void *[]){runpy, names, block, text, NULL, NULL}, **end = used + 4; used < end; used++)
            if (*used) py.decref(*used);
        py.release(lock);
        if (!m->python) fault = "runtime.py cannot be run by this Python: the error output says why; it needs jax and numpy";
        else if (m->message[0]) fault = m->message;
    }
    if (fault) {
        fail(m, Error, fault);
        free(m->name), free(m);
        return NULL;
    }
    memcpy(m->start, z_of(m), sizeof m->start);
    return m;
}

FMI const char *fmi3GetVersion(void) { return "3.0"; }

FMI Status fmi3SetDebugLogging(Instance m, bool on, size_t n, const char *const categories[]) { return OK; }

FMI Instance fmi3InstantiateModelExchange(const char *name, const char *token, const char *resources, bool visible,
                                          bool logging, Environment environment, Log log) {
    return IS_ME ? instantiate(name, token, resources, environment, log, false) : NULL;
}

FMI Instance fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible,
                                         bool logging, bool event_mode, bool early_return, const Ref required[],
                                         size_t n, Environment environment, Log log, void *intermediate_update) {
    return IS_ME ? NULL : instantiate(name, token, resources, environment, log, true);
}

FMI Instance fmi3InstantiateScheduledExecution(const char *name, const char *token, const char *resources, bool visible,
                                               bool logging, Environment environment, Log log, void *clock_update,
                                               void *lock, void *unlock) {
    return NULL;
}

FMI void fmi3FreeInstance(Instance instance) {
    Model *m = instance;
    if (!m) return;
    int lock = py.ensure();
    py.decref(m->python);
    py.release(lock);
    free(m->name), free(m);
}

FMI Status fmi3EnterInitializationMode(Instance instance, bool has_tolerance, double tolerance, double start,
                                       bool has_stop, double stop) {
    put(instance, 0, start);
    return OK;
}

FMI Status fmi3ExitInitializationMode(Instance m) { return accept(m); }
FMI Status fmi3EnterEventMode(Instance m) { return OK; }
FMI Status fmi3EnterStepMode(Instance m) { return OK; }
FMI Status fmi3EnterContinuousTimeMode(Instance m) { return OK; }
FMI Status fmi3EnterConfigurationMode(Instance m) { return OK; }
FMI Status fmi3ExitConfigurationMode(Instance m) { return OK; }
FMI Status fmi3Terminate(Instance m) { return OK; }

FMI Status fmi3Reset(Instance instance) {
    Model *m = instance;
    memcpy(z_of(m), m->start, sizeof m->start);
    m->is_current = false;
    return OK;
}

FMI Status fmi3GetFloat64(Instance instance, const Ref refs[], size_t n, double values[], size_t num_values) {
    Model *m = instance;
    if (n != num_values) return fail(m, Error, "fmi3GetFloat64: all variables have one value");
    for (size_t i = 0; i < n; i++) {
        if (refs[i] >= NUM_Z + NUM_UNKNOWN) return fail(m, Error, "fmi3GetFloat64: no variable has that reference");
        Status status = refs[i] < NUM_Z ? OK : evaluate(m);
        if (status != OK) return status;
        values[i] = m->block[refs[i]];
    }
    return OK;
}

FMI Status fmi3SetFloat64(Instance instance, const Ref refs[], size_t n, const double values[], size_t num_values) {
    Model *m = instance;
    if (n != num_values) return fail(m, Error, "fmi3SetFloat64: all variables have one value");
    for (size_t i = 0; i < n; i++)
        if (!refs[i] || refs[i] >= NUM_KNOWN)
            return fail(m, Error, "fmi3SetFloat64: only states, inputs and parameters can be set");
    for (size_t i = 0; i < n; i++) put(m, refs[i], values[i]);
    return OK;
}

/* Variables of other types: there are none. */
static Status none(Model *m, size_t n) {
    return n ? fail(m, Error, "all variables are of type Float64") : OK;
}
#define OTHER(NAME, TYPE)                                                                                          \
    FMI Status fmi3Get##NAME(Instance m, const Ref r[], size_t n, TYPE v[], size_t k) { return none(m, n); }        \
    FMI Status fmi3Set##NAME(Instance m, const Ref r[], size_t n, const TYPE v[], size_t k) { return none(m, n); }
OTHER(Float32, float)
OTHER(Int8, int8_t)
OTHER(UInt8, uint8_t)
OTHER(Int16, int16_t)
OTHER(UInt16, uint16_t)
OTHER(Int32, int32_t)
OTHER(UInt32, uint32_t)
OTHER(Int64, int64_t)
OTHER(UInt64, uint64_t)
OTHER(Boolean, bool)
OTHER(String, char *)
#define EMPTY(NAME, ...) FMI Status NAME(Instance m, const Ref r[], size_t n, __VA_ARGS__) { return none(m, n); }
EMPTY(fmi3GetBinary, size_t sizes[], uint8_t *v[], size_t k)
EMPTY(fmi3SetBinary, const size_t sizes[], const uint8_t *const v[], size_t k)
EMPTY(fmi3GetClock, bool v[])
EMPTY(fmi3SetClock, const bool v[])
EMPTY(fmi3GetIntervalDecimal, double intervals[], int qualifiers[])
EMPTY(fmi3GetIntervalFraction, uint64_t counters[], uint64_t resolutions[], int qualifiers[])
EMPTY(fmi3GetShiftDecimal, double shifts[])
EMPTY(fmi3GetShiftFraction, uint64_t counters[], uint64_t resolutions[])
EMPTY(fmi3SetIntervalDecimal, const double intervals[])
EMPTY(fmi3SetIntervalFraction, const uint64_t counters[], const uint64_t resolutions[])
EMPTY(fmi3SetShiftDecimal, const double shifts[])
EMPTY(fmi3SetShiftFraction, const uint64_t counters[], const uint64_t resolutions[])
EMPTY(fmi3GetOutputDerivatives, const int32_t orders[], double v[], size_t k)

FMI Status fmi3GetNumberOfVariableDependencies(Instance m, Ref variable, size_t *n) {
    return fail(m, Error, "the dependencies are in modelDescription.xml");
}
FMI Status fmi3GetVariableDependencies(Instance m, Ref dependent, size_t elements[], Ref independents[],
                                       size_t places[], int kinds[], size_t n) {
    return fail(m, Error, "the dependencies are in modelDescription.xml");
}

/* A state of the FMU is z; the bytes of one begin with the token. */
FMI Status fmi3GetFMUState(Instance instance, State *state) {
    if (!*state) *state = malloc(NUM_Z * sizeof(double));
    if (!*state) return fail(instance, Error, "no memory is left");
    memcpy(*state, z_of(instance), NUM_Z * sizeof(double));
    return OK;
}

FMI Status fmi3SetFMUState(Instance instance, State state) {
    Model *m = instance;
    if (!state) return fail(m, Error, "fmi3SetFMUState: there is no state");
    memcpy(z_of(m), state, NUM_Z * sizeof(double));
    m->is_current = false;
    return OK;
}

FMI Status fmi3FreeFMUState(Instance m, State *state) {
    if (state) free(*state), *state = NULL;
    return OK;
}

FMI Status fmi3SerializedFMUStateSize(Instance m, State state, size_t *size) {
    *size = sizeof(TOKEN) + NUM_Z * sizeof(double);
    return OK;
}

FMI Status fmi3SerializeFMUState(Instance m, State state, uint8_t bytes[], size_t size) {
    if (size < sizeof(TOKEN) + NUM_Z * sizeof(double)) return fail(m, Error, "fmi3SerializeFMUState: too few bytes");
    memcpy(bytes, TOKEN, sizeof(TOKEN));
    memcpy(bytes + sizeof(TOKEN), state, NUM_Z * sizeof(double));
    return OK;
}

FMI Status fmi3DeserializeFMUState(Instance m, const uint8_t bytes[], size_t size, State *state) {
    if (size != sizeof(TOKEN) + NUM_Z * sizeof(double) || memcmp(bytes, TOKEN, sizeof(TOKEN)))
        return fail(m, Error, "fmi3DeserializeFMUState: the bytes are not a state of this FMU");
    if (!*state) *state = malloc(NUM_Z * sizeof(double));
    if (!*state) return fail(m, Error, "no memory is left");
    memcpy(*state, bytes + sizeof(TOKEN), NUM_Z * sizeof(double));
    return OK;
}

/* Seeds go to their places, sensitivities come from theirs. */
static Status differentiate(Model *m, const char *method, const Ref from[], size_t num_from, const double seed[],
                            size_t num_seed, size_t first_from, size_t end_from, const Ref to[], size_t num_to,
                            double sensitivity[], size_t num_sensitivity, size_t first_to, size_t end_to) {
    if (num_from != num_seed || num_to != num_sensitivity) return fail(m, Error, "all variables have one value");
    for (size_t i = 0; i < num_from; i++)
        if (from[i] < first_from || from[i] >= end_from)
            return fail(m, Error, "derivatives are of state derivatives and outputs by time, states, inputs and parameters");
    for (size_t i = 0; i < num_to; i++)
        if (to[i] < first_to || to[i] >= end_to)
            return fail(m, Error, "derivatives are of state derivatives and outputs by time, states, inputs and parameters");
    memset(seed_of(m), 0, NUM_SEED * sizeof(double));
    for (size_t i = 0; i < num_from; i++) seed_of(m)[from[i] - first_from] += seed[i];
    Status status = ask(m, method);
    for (size_t i = 0; i < num_to; i++) sensitivity[i] = status == OK ? sensitivity_of(m)[to[i] - first_to] : NAN;
    return status;
}

FMI Status fmi3GetDirectionalDerivative(Instance m, const Ref unknowns[], size_t num_unknowns, const Ref knowns[],
                                        size_t num_knowns, const double seed[], size_t num_seed, double sensitivity[],
                                        size_t num_sensitivity) {
    return differentiate(m, "directional", knowns, num_knowns, seed, num_seed, 0, NUM_KNOWN, unknowns, num_unknowns,
                         sensitivity, num_sensitivity, NUM_Z, NUM_Z + NUM_UNKNOWN);
}

FMI Status fmi3GetAdjointDerivative(Instance m, const Ref unknowns[], size_t num_unknowns, const Ref knowns[],
                                    size_t num_knowns, const double seed[], size_t num_seed, double sensitivity[],
                                    size_t num_sensitivity) {
    return differentiate(m, "adjoint", unknowns, num_unknowns, seed, num_seed, NUM_Z, NUM_Z + NUM_UNKNOWN, knowns,
                         num_knowns, sensitivity, num_sensitivity, 0, NUM_KNOWN);
}

FMI Status fmi3EvaluateDiscreteStates(Instance m) { return OK; }

FMI Status fmi3UpdateDiscreteStates(Instance m, bool *needs_update, bool *terminate, bool *nominals_changed,
                                    bool *values_changed, bool *has_next, double *next) {
    *needs_update = *terminate = *nominals_changed = *values_changed = *has_next = false;
    return take(m);
}

FMI Status fmi3CompletedIntegratorStep(Instance m, bool no_set_state, bool *enter_event_mode, bool *terminate) {
    *enter_event_mode = *terminate = false;
    return take(m);
}

FMI Status fmi3SetTime(Instance m, double time) {
    put(m, 0, time);
    return OK;
}

FMI Status fmi3SetContinuousStates(Instance m, const double x[], size_t n) {
    if (n != NUM_X) return fail(m, Error, "fmi3SetContinuousStates: another number of states");
    for (size_t i = 0; i < n; i++) put(m, 1 + i, x[i]);
    return OK;
}

FMI Status fmi3GetContinuousStateDerivatives(Instance m, double rates[], size_t n) {
    if (n != NUM_X) return fail(m, Error, "fmi3GetContinuousStateDerivatives: another number of states");
    Status status = evaluate(m);
    for (size_t i = 0; i < n; i++) rates[i] = status == OK ? results_of(m)[i] : NAN;
    return status;
}

FMI Status fmi3GetContinuousStates(Instance m, double x[], size_t n) {
    if (n != NUM_X) return fail(m, Error, "fmi3GetContinuousStates: another number of states");
    memcpy(x, z_of(m) + 1, n * sizeof(double));
    return OK;
}

FMI Status fmi3GetNominalsOfContinuousStates(Instance m, double nominals[], size_t n) {
    if (n != NUM_X) return fail(m, Error, "fmi3GetNominalsOfContinuousStates: another number of states");
    memcpy(nominals, nominals_of(m), n * sizeof(double));
    return OK;
}

FMI Status fmi3GetEventIndicators(Instance m, double indicators[], size_t n) { return none(m, n); }

FMI Status fmi3GetNumberOfEventIndicators(Instance m, size_t *n) {
    *n = 0;
    return OK;
}

FMI Status fmi3GetNumberOfContinuousStates(Instance m, size_t *n) {
    *n = NUM_X;
    return OK;
}

FMI Status fmi3DoStep(Instance instance, double time, double step, bool no_set_state, bool *event, bool *terminate,
                      bool *early_return, double *last_time) {
    Model *m = instance;
    *event = *terminate = *early_return = false;
    *last_time = time;
    if (!m->is_co_simulation || !(step > 0) || !isfinite(time + step))
        return fail(m, Error, "fmi3DoStep: a step has a positive length, and only an FMU of co-simulation takes one");
    put(m, 0, time);
    seed_of(m)[0] = step;
    Status status = ask(m, "step");
    m->is_current = false;
    if (status == OK) *last_time = time + step;
    return status;
}

FMI Status fmi3ActivateModelPartition(Instance m, Ref clock, double time) {
    return fail(m, Error, "this FMU has no partitions");
}
