/* Runs tapes from the standard input under sanitisers, each over an arena of exactly its size, for a while at most.
 *
 * A tape: numbers of instructions, starts, table entries and doubles; then these.  Prints how many ended by themselves.
 */
/* Tapes by turns with and without wide registers. */
#ifdef __x86_64__
static long turn;
#define IS_WIDE (turn++ & 1 && __builtin_cpu_supports("avx2"))
#endif
#include "machine.c"

#include <setjmp.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/time.h>

static sigjmp_buf late;

static void stop(int signal) { siglongjmp(late, signal); }

static void nothing(int64_t instruction, double *arena) { (void)instruction, (void)arena; }

static void *block(int64_t numbers, size_t size) {
  void *found = malloc((size_t)numbers * size);
  if (fread(found, size, (size_t)numbers, stdin) != (size_t)numbers) abort();
  return found;
}

static void set_timer(int milliseconds) {
  struct itimerval timer = {{0, 0}, {0, 1000 * milliseconds}};
  setitimer(ITIMER_VIRTUAL, &timer, NULL);
}

/* A report is written to its end. */
void __asan_on_error(void) { set_timer(0); }
void __ubsan_on_report(void) { set_timer(0); }

int main(void) {
  int64_t number[4];
  volatile int64_t done = 0, all = 0;
  signal(SIGVTALRM, stop);
  while (fread(number, 8, 4, stdin) == 4) {
    Instruction *code = block(number[0], sizeof(Instruction));
    int32_t *starts = block(number[1], 4), *tables = block(number[2], 4);
    double *arena = block(number[3], 8);
    all++;
    if (!sigsetjmp(late, 1)) {
      set_timer(5);
      tape_run(code, starts, tables, arena, nothing);
      done++;
    }
    set_timer(0);
    free(code), free(starts), free(tables), free(arena);
  }
  printf("%lld %lld\n", (long long)all, (long long)done);
  return 0;
}
