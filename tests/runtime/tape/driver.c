/* Runs tapes from the standard input under sanitisers, each over an arena of exactly its size, for a while at most.
 *
 * A tape: numbers of instructions, starts, table entries and doubles; then these.  Prints how many ended by themselves.
 */
#include "machine.c"

#include <setjmp.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/time.h>

static sigjmp_buf late;

static void stop(int signal) { siglongjmp(late, signal); }

static void nothing(int64_t instruction, double *arena) { (void)instruction, (void)arena; }

static void *block(int64_t numbers) {
  void *found = malloc((size_t)numbers * 8);
  if (fread(found, 8, (size_t)numbers, stdin) != (size_t)numbers) abort();
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
  const int64_t fields = sizeof(Instruction) / 8;
  int64_t number[4];
  volatile int64_t done = 0, all = 0;
  signal(SIGVTALRM, stop);
  while (fread(number, 8, 4, stdin) == 4) {
    Instruction *code = block(number[0] * fields);
    int64_t *starts = block(number[1]), *tables = block(number[2]);
    double *arena = block(number[3]);
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
