/* A host that is no Python: rates and an output of an FMU of model exchange at one state.
Arguments: the library, the token, the folder of the resources, the reference of an output, the states. */
#include <dlfcn.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

static void say(void *environment, int status, const char *category, const char *message) {
    fprintf(stderr, "%d %s: %s\n", status, category, message);
}

int main(int argc, char **argv) {
    void *library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) return fprintf(stderr, "%s\n", dlerror()), 1;
    void *(*instantiate)(const char *, const char *, const char *, bool, bool, void *, void *) =
        dlsym(library, "fmi3InstantiateModelExchange");
    int (*begin)(void *, bool, double, double, bool, double) = dlsym(library, "fmi3EnterInitializationMode");
    int (*end)(void *) = dlsym(library, "fmi3ExitInitializationMode");
    int (*set)(void *, const double *, size_t) = dlsym(library, "fmi3SetContinuousStates");
    int (*get)(void *, double *, size_t) = dlsym(library, "fmi3GetContinuousStateDerivatives");
    int (*value)(void *, const uint32_t *, size_t, double *, size_t) = dlsym(library, "fmi3GetFloat64");
    void (*release)(void *) = dlsym(library, "fmi3FreeInstance");
    void *one = instantiate("one", argv[2], argv[3], false, false, NULL, say);
    void *two = instantiate("two", argv[2], argv[3], false, false, NULL, say);
    if (!one || !two) return 2;
    size_t n = argc - 5;
    double *x = calloc(n, sizeof(double)), *rates = calloc(n, sizeof(double)), output;
    uint32_t place = strtoul(argv[4], NULL, 10);
    for (size_t i = 0; i < n; i++) x[i] = atof(argv[5 + i]);
    int status = begin(one, false, 0.0, 0.0, false, 0.0) | end(one) | set(one, x, n) | get(one, rates, n);
    status |= value(one, &place, 1, &output, 1);
    for (size_t i = 0; i < n; i++) printf("%.17g ", rates[i]);
    printf("%.17g\n", output);
    release(two), release(one);
    return status;
}
