/* The tape machine: runs the instructions of a tape over an arena of doubles.
 *
 * Every number is a double, integers and truth values too.  Offsets count doubles from the start of the arena; `table`
 * offsets count whole numbers from the start of the tables.  An operand whose bit is set in `splat` is one number that
 * stands for many.  Nothing is allocated and nothing global is written, so that one tape may run in several threads,
 * each with an arena of its own.  Results are those of IEEE arithmetic, and of XLA where IEEE leaves a choice: a NaN
 * wins in max and min, an index out of range is clamped or left out, int32 wraps round.  Only numbers below 2e-308,
 * which XLA takes for zero, stay what they are.
 */
#include <math.h>
#include <stdint.h>
#include <string.h>

enum {
#define OP(name, operands) name,
#include "opcodes.h"
#undef OP
};

typedef struct {
  int32_t op, mode, n, out, a, b, c, splat, x0, x1, x2, x3, table;
} Instruction;

typedef void (*Host)(int64_t instruction, double *arena);
typedef void (*Products)(const Instruction *i, const int32_t *table, double *result, const double *a, const double *b);

typedef struct {
  const Instruction *code;
  const int32_t *starts; /* of each tape in the code, and the end of the last one */
  const int32_t *tables;
  double *M;
  Host host;
  Products products;
} Machine;

static void run(const Machine *m, int64_t tape);

#ifndef SOURCES
#define SOURCES 0
#endif
/* The number of the sources that this was built from, which Python compares with those at hand. */
int64_t tape_sources(void) { return SOURCES; }

/* ------------------------------------------------------------------------------------------------------ small parts */
static double power(double x, int64_t y) {
  uint64_t left = y < 0 ? -(uint64_t)y : (uint64_t)y;
  double result = 1.0;
  for (; left; left >>= 1, x *= x)
    if (left & 1) result *= x;
  return y < 0 ? 1.0 / result : result;
}

/* A number as a whole one: 2^63, which no whole one is, stands for the largest. */
static int64_t whole(double x) {
  return x >= 9223372036854775808.0 ? INT64_MAX : x >= -9223372036854775808.0 ? (int64_t)x : x != x ? 0 : INT64_MIN;
}

/* A number as an index from 0 to the largest; NaN is 0. */
static int64_t clamped(double x, int64_t largest) { return x > 0 ? (x < (double)largest ? (int64_t)x : largest) : 0; }

/* The nearest to zero within a range, never -0. */
static double to_integer(double x, double low, double high) { return x != x ? 0.0 : x < low ? low : x > high ? high : trunc(x) + 0.0; }

/* NaN wins, and of two zeros that with the sign. */
static double larger(double x, double y) { return x > y ? x : x < y ? y : x == y ? (signbit(x) ? y : x) : x != x ? x : y; }
static double smaller(double x, double y) { return x < y ? x : x > y ? y : x == y ? (signbit(x) ? x : y) : x != x ? x : y; }

/* A whole number that is in the order of all doubles: -NaN, -inf, ... -0, 0, ... inf, NaN. */
static int64_t in_order(double x) {
  int64_t bits;
  memcpy(&bits, &x, sizeof bits);
  return bits < 0 ? INT64_MAX ^ bits : bits;
}

/* Whole quotients and remainders of XLA, where the divisor is zero too. */
static int64_t quotient(int64_t x, int64_t y) { return y == 0 ? -1 : y == -1 ? (int64_t)(0 - (uint64_t)x) : x / y; }
static int64_t remainder_of(int64_t x, int64_t y) { return y == 0 ? x : y == -1 ? 0 : x % y; }

/* x modulo 2^32, with a sign where bits is 32 and without where it is -32; as it is for 64 bits. */
static double wrapped(int64_t x, int64_t bits) {
  return bits == 32 ? (double)(int32_t)(uint32_t)(uint64_t)x : bits == -32 ? (double)(uint32_t)(uint64_t)x : (double)x;
}

/* `wrapped`, telling the host (-1) of a number of 64 bits that no double has. */
static double exactly(const Machine *m, int64_t x, int64_t bits) {
  if (bits == 64 && (x > 9007199254740992 || x < -9007199254740992)) m->host(-1, m->M);
  return wrapped(x, bits);
}

static void fill(double *to, double x, int64_t n) {
  for (int64_t k = 0; k < n; k++) to[k] = x;
}

static void copy(double *to, const double *from, int64_t n, int is_splat) {
  if (is_splat)
    fill(to, *from, n);
  else if (to != from)
    memmove(to, from, (size_t)n * sizeof(double));
}

/* Start of a slice: (stride, largest index, place of the index) for each of `dims` axes; indices are clamped. */
static int64_t slice_start(const int32_t *t, int64_t dims, const double *M) {
  int64_t start = 0;
  for (int64_t d = 0; d < dims; d++, t += 3) start += clamped(M[t[2]], t[1]) * t[0];
  return start;
}

/* Start of a row of a gather or scatter: clamps indices and says whether all were in range. */
static int64_t row_start(const int32_t *slots, int64_t dims, const double *index, int *is_good) {
  int64_t start = 0;
  *is_good = 1;
  for (int64_t d = 0; d < dims; d++, slots += 2) {
    if (!(index[d] >= 0 && index[d] <= (double)slots[1])) *is_good = 0;
    start += clamped(index[d], slots[1]) * slots[0];
  }
  return start;
}

static int is_before(const double *key, int64_t stride, int64_t p, int64_t q, int64_t keys, int64_t step) {
  for (int64_t k = 0; k < keys; k++, key += step) {
    double x = key[p * stride], y = key[q * stride];
    if (x < y || (y != y && x == x)) return 1;
    if (y < x || (x != x && y == y)) return 0;
  }
  return 0;
}

/* Order of K entries by merging, equal ones as they are; order and spare hold K whole numbers. */
static void merge_sort(int64_t *order, int64_t *spare, int64_t K, const double *key, int64_t stride, int64_t keys, int64_t step) {
  for (int64_t k = 0; k < K; k++) order[k] = k;
  for (int64_t width = 1; width < K; width *= 2) {
    for (int64_t low = 0; low < K; low += 2 * width) {
      int64_t middle = low + width < K ? low + width : K, high = low + 2 * width < K ? low + 2 * width : K;
      int64_t p = low, q = middle;
      for (int64_t k = low; k < high; k++)
        spare[k] = p < middle && (q >= high || !is_before(key, stride, order[q], order[p], keys, step)) ? order[p++] : order[q++];
    }
    memcpy(order, spare, (size_t)K * sizeof(int64_t));
  }
}

/* ----------------------------------------------------------------------------------------------------- linear algebra */
/* Lower factors of `batch` matrices (N, N), in place; NaN where one is not positive definite. */
static void cholesky(double *o, int64_t batch, int64_t N) {
  for (int64_t z = 0; z < batch; z++, o += N * N) {
    int is_good = 1;
    for (int64_t j = 0; j < N; j++) {
      double d = o[j * N + j];
      for (int64_t k = 0; k < j; k++) d -= o[j * N + k] * o[j * N + k];
      if (!(d > 0)) is_good = 0;
      d = sqrt(d);
      o[j * N + j] = d;
      for (int64_t r = j + 1; r < N; r++) {
        double v = o[r * N + j];
        for (int64_t k = 0; k < j; k++) v -= o[r * N + k] * o[j * N + k];
        o[r * N + j] = v / d;
      }
      fill(o + j * N + j + 1, 0.0, N - j - 1);
    }
    if (!is_good) fill(o, NAN, N * N);
  }
}

/* Solves with triangular matrices A (N, N): x (of N numbers `along` apart, K of them `beside` apart), in place. */
static void triangular(double *x, const double *A, int64_t N, int64_t K, int64_t along, int64_t beside, int is_lower, int is_transposed, int is_unit) {
  int is_forward = is_lower != is_transposed;
  for (int64_t q = 0; q < N; q++) {
    int64_t r = is_forward ? q : N - 1 - q, from = is_forward ? 0 : r + 1, to = is_forward ? r : N;
    for (int64_t k = from; k < to; k++) {
      double v = is_transposed ? A[k * N + r] : A[r * N + k];
      for (int64_t c = 0; c < K; c++) x[r * along + c * beside] -= v * x[k * along + c * beside];
    }
    if (!is_unit)
      for (int64_t c = 0; c < K; c++) x[r * along + c * beside] /= A[r * N + r];
  }
}

/* Factors of one matrix (R, C) by rows, in place; pivots (min(R, C)) and the permutation (R) of rows. */
static void lu(double *o, double *pivots, double *order, int64_t R, int64_t C) {
  for (int64_t k = 0; k < R; k++) order[k] = (double)k;
  for (int64_t k = 0; k < R && k < C; k++) {
    int64_t best = k;
    for (int64_t r = k + 1; r < R; r++)
      if (fabs(o[r * C + k]) > fabs(o[best * C + k])) best = r;
    pivots[k] = (double)best;
    if (best != k) {
      double row = order[k];
      order[k] = order[best], order[best] = row;
      for (int64_t c = 0; c < C; c++) {
        double v = o[k * C + c];
        o[k * C + c] = o[best * C + c], o[best * C + c] = v;
      }
    }
    for (int64_t r = k + 1; r < R; r++) {
      const double f = o[k * C + k] == 0.0 ? o[r * C + k] : o[r * C + k] / o[k * C + k];
      o[r * C + k] = f;
      for (int64_t c = k + 1; c < C; c++) o[r * C + c] -= f * o[k * C + c];
    }
  }
}

/* A matrix within the arena: places of rows and columns by tables, or at regular strides where there is none. */
typedef struct {
  const double *from;
  const int32_t *row_place, *column_place;
  int64_t row, column;
} Matrix;

#define INLINE static inline __attribute__((always_inline))

INLINE double entry(const Matrix *x, int64_t p, int64_t j) {
  return x->from[(x->row_place ? x->row_place[p] : p * x->row) + (x->column_place ? x->column_place[j] : j * x->column)];
}

/* Product of A (m, k) and B (n, k), row by row. */
INLINE void multiply(double *o, const Matrix *A, const Matrix *B, int64_t m, int64_t n, int64_t k) {
  for (int64_t p = 0; p < m; p++, o += n)
    if (!B->row_place && B->row == 1 && n > 3) {
      fill(o, 0.0, n);
      for (int64_t j = 0; j < k; j++) {
        const double x = entry(A, p, j), *b = B->from + j * B->column;
        for (int64_t q = 0; q < n; q++) o[q] += x * b[q];
      }
    } else
      for (int64_t q = 0; q < n; q++) {
        double sum = 0.0;
        for (int64_t j = 0; j < k; j++) sum += entry(A, p, j) * entry(B, q, j);
        o[q] = sum;
      }
}

enum { WIDTH = 4, DEPTH = 64 };
typedef double Numbers __attribute__((vector_size(8 * WIDTH)));

INLINE void load(Numbers *x, const Matrix *B, int64_t q, int64_t j, int64_t width) {
  *x = (Numbers){entry(B, q, j)};
  if (width > 1) (*x)[1] = entry(B, q + 1, j);
  if (width > 2) (*x)[2] = entry(B, q + 2, j);
  if (width > 3) (*x)[3] = entry(B, q + 3, j);
}

INLINE void store(double *to, int64_t stride, const Numbers *x, int64_t width) {
  to[0] = (*x)[0];
  if (width > 1) to[stride] = (*x)[1];
  if (width > 2) to[2 * stride] = (*x)[2];
  if (width > 3) to[3 * stride] = (*x)[3];
}

/* The same, four columns side by side; entry (p, q) goes to o[p * by_row + q * by_column]. */
INLINE void multiply_wide(double *o, const Matrix *A, const Matrix *B, int64_t m, int64_t n, int64_t k, int64_t by_row, int64_t by_column) {
  Numbers part[DEPTH];
  for (int64_t q = 0; q < n; q += WIDTH) {
    const int64_t width = n - q < WIDTH ? n - q : WIDTH;
    for (int64_t start = 0; start == 0 || start < k; start += DEPTH) {
      const int64_t depth = k - start < DEPTH ? k - start : DEPTH;
      for (int64_t j = 0; j < depth; j++) load(&part[j], B, q, start + j, width);
      for (int64_t p = 0; p < m; p++) {
        double *to = o + p * by_row + q * by_column;
        Numbers sum = {0.0};
        if (start) load(&sum, &(Matrix){to, 0, 0, by_column, 0}, 0, 0, width);
        for (int64_t j = 0; j < depth; j++) sum += entry(A, p, start + j) * part[j];
        store(to, by_column, &sum, width);
      }
    }
  }
}

INLINE double *product(double *o, Matrix A, Matrix B, int64_t m, int64_t n, int64_t k, int is_wide) {
  if (!is_wide || m * n < 12 || ((m == 1 || n == 1) && k < 8)) /* small ones are not worth the loading */
    multiply(o, &A, &B, m, n, k);
  else if (n < 3 && m > n)
    multiply_wide(o, &B, &A, n, m, k, 1, n);
  else
    multiply_wide(o, &A, &B, m, n, k, n, 1);
  return o + m * n;
}

/* x0 products.  Table of DOT: sizes (m, n, k), strides (4), starts in a and in b; of DOT_TABLE, of (x1, x3) and (x2, x3):
 * starts in a, b, places of rows, of columns, of sums in a and in b. */
INLINE void products(const Instruction *i, const int32_t *t, double *o, const double *a, const double *b, int is_wide) {
  if (i->op == DOT) {
    const int64_t m = t[0], n = t[1], k = t[2];
    for (int64_t z = 0; z < i->x0; z++)
      o = product(o, (Matrix){a + t[7 + z], 0, 0, t[3], t[4]}, (Matrix){b + t[7 + i->x0 + z], 0, 0, t[5], t[6]}, m, n, k, is_wide);
  } else {
    const int32_t *in_a = t, *in_b = in_a + i->x0, *am = in_b + i->x0, *bn = am + i->x1, *ak = bn + i->x2, *bk = ak + i->x3;
    for (int64_t z = 0; z < i->x0; z++)
      o = product(o, (Matrix){a + in_a[z], am, ak, 0, 0}, (Matrix){b + in_b[z], bn, bk, 0, 0}, i->x1, i->x2, i->x3, is_wide);
  }
}

static void products_plain(const Instruction *i, const int32_t *t, double *o, const double *a, const double *b) {
  products(i, t, o, a, b, 0);
}

/* By registers of four numbers; each sum runs from its first to its last term here too, so that the bits are the same. */
#if defined(__x86_64__) && defined(__GNUC__)
#ifndef IS_WIDE
#define IS_WIDE __builtin_cpu_supports("avx2")
#endif
__attribute__((target("avx2")))
#else
#define IS_WIDE 0
#endif
static void products_wide(const Instruction *i, const int32_t *t, double *o, const double *a, const double *b) {
  products(i, t, o, a, b, 1);
}

/* ------------------------------------------------------------------------------------------------------- instructions */
#define UNARY(OP, E)                                                                    \
  case OP: {                                                                            \
    if (i->splat & 1) {                                                                 \
      const double x = *a;                                                              \
      fill(o, (E), n);                                                                  \
    } else                                                                              \
      for (int64_t k = 0; k < n; k++) {                                                 \
        const double x = a[k];                                                          \
        o[k] = (E);                                                                     \
      }                                                                                 \
    break;                                                                              \
  }
#define BINARY(OP, E)                                                                   \
  case OP: {                                                                            \
    if (n == 1) {                                                                       \
      const double x = *a, y = *b;                                                      \
      *o = (E);                                                                         \
    } else if ((i->splat & 3) == 0)                                                     \
      for (int64_t k = 0; k < n; k++) {                                                 \
        const double x = a[k], y = b[k];                                                \
        o[k] = (E);                                                                     \
      }                                                                                 \
    else if ((i->splat & 3) == 2) {                                                     \
      const double y = *b;                                                              \
      for (int64_t k = 0; k < n; k++) {                                                 \
        const double x = a[k];                                                          \
        o[k] = (E);                                                                     \
      }                                                                                 \
    } else if ((i->splat & 3) == 1) {                                                   \
      const double x = *a;                                                              \
      for (int64_t k = 0; k < n; k++) {                                                 \
        const double y = b[k];                                                          \
        o[k] = (E);                                                                     \
      }                                                                                 \
    } else {                                                                            \
      const double x = *a, y = *b;                                                      \
      fill(o, (E), n);                                                                  \
    }                                                                                   \
    break;                                                                              \
  }
/* Of (outer, x0, x1) numbers over the axis in the middle; r is what was found so far. */
#define REDUCE(OP, START, E)                                                            \
  case OP: {                                                                            \
    const int64_t K = i->x0, inner = i->x1;                                             \
    for (int64_t p = 0; p < n / inner; p++, a += K * inner, o += inner)                 \
      for (int64_t c = 0; c < inner; c++) {                                             \
        double r = (START);                                                             \
        for (int64_t k = 0; k < K; k++) {                                               \
          const double x = a[k * inner + c];                                            \
          r = (E);                                                                      \
        }                                                                               \
        o[c] = r;                                                                       \
      }                                                                                 \
    break;                                                                              \
  }
#define ARGUMENT(OP, IS_BETTER)                                                         \
  case OP: {                                                                            \
    const int64_t K = i->x0, inner = i->x1;                                             \
    for (int64_t p = 0; p < n / inner; p++, a += K * inner, o += inner)                 \
      for (int64_t c = 0; c < inner; c++) {                                             \
        int64_t best = 0;                                                               \
        double y = a[c];                                                                \
        for (int64_t k = 1; k < K; k++) {                                               \
          const double x = a[k * inner + c];                                            \
          if ((IS_BETTER) || (x != x && y == y)) y = x, best = k;                       \
        }                                                                               \
        o[c] = (double)best;                                                            \
      }                                                                                 \
    break;                                                                              \
  }
#define CUMULATIVE(OP, E)                                                               \
  case OP: {                                                                            \
    const int64_t K = i->x0, inner = i->x1, step = i->mode ? -inner : inner;            \
    for (int64_t p = 0; p < n / (K * inner); p++)                                       \
      for (int64_t c = 0; c < inner; c++) {                                             \
        int64_t k = (p * K + (i->mode ? K - 1 : 0)) * inner + c;                        \
        double r = a[k];                                                                \
        o[k] = r;                                                                       \
        for (int64_t q = 1; q < K; q++) {                                               \
          k += step;                                                                    \
          const double x = a[k];                                                        \
          r = (E);                                                                      \
          o[k] = r;                                                                     \
        }                                                                               \
      }                                                                                 \
    break;                                                                              \
  }

static void step(const Machine *m, const Instruction *i) {
  double *const M = m->M, *o = M + i->out;
  const double *a = M + i->a, *b = M + i->b, *c = M + i->c;
  const int64_t n = i->n;
  const int32_t *t = m->tables + i->table;
  switch (i->op) {
    case COPY: copy(o, a, n, i->splat & 1); break;
      UNARY(NEG, -x)
      UNARY(SIN, sin(x))
      UNARY(COS, cos(x))
      UNARY(TAN, tan(x))
      UNARY(ASIN, asin(x))
      UNARY(ACOS, acos(x))
      UNARY(ATAN, atan(x))
      UNARY(SINH, sinh(x))
      UNARY(COSH, cosh(x))
      UNARY(TANH, tanh(x))
      UNARY(ASINH, asinh(x))
      UNARY(ACOSH, acosh(x))
      UNARY(ATANH, atanh(x))
      UNARY(SQRT, sqrt(x))
      UNARY(RSQRT, 1.0 / sqrt(x))
      UNARY(CBRT, cbrt(x))
      UNARY(EXP, exp(x))
      UNARY(EXP2, exp2(x))
      UNARY(EXPM1, expm1(x))
      UNARY(LOG, log(x))
      UNARY(LOG1P, log1p(x))
      UNARY(LOGISTIC, 1.0 / (1.0 + exp(-x)))
      UNARY(ERF, erf(x))
      UNARY(ERFC, erfc(x))
      UNARY(LGAMMA, lgamma(x))
      UNARY(ABS, fabs(x))
      UNARY(SIGN, x > 0 ? 1.0 : x < 0 ? -1.0 : x)
      UNARY(FLOOR, floor(x))
      UNARY(CEIL, ceil(x))
      UNARY(ROUND_AWAY, round(x))
      UNARY(ROUND_EVEN, nearbyint(x))
      UNARY(SQUARE, x *x)
      UNARY(POWER, power(x, i->x0))
      UNARY(ISFINITE, isfinite(x) ? 1.0 : 0.0)
      UNARY(SIGNBIT, signbit(x) ? 1.0 : 0.0)
      UNARY(NOT, x == 0.0)
      UNARY(NOTBITS, exactly(m, ~whole(x), i->x0))
      UNARY(TRUTH, x != 0.0)
      UNARY(TO_INT32, to_integer(x, -2147483648.0, 2147483647.0))
      UNARY(TO_INT64, to_integer(x, -9223372036854775808.0, 9223372036854775808.0))
      UNARY(TO_UINT32, to_integer(x, 0.0, 4294967295.0))
      UNARY(WRAP_INT32, wrapped(whole(x), 32))
      UNARY(WRAP_UINT32, wrapped(whole(x), -32))
      BINARY(ADD, x + y)
      BINARY(SUB, x - y)
      BINARY(MUL, x *y)
      BINARY(DIV, x / y)
      BINARY(MAX, larger(x, y))
      BINARY(MIN, smaller(x, y))
      BINARY(POW, pow(x, y))
      BINARY(REM, fmod(x, y))
      BINARY(ATAN2, atan2(x, y))
      BINARY(NEXTAFTER, nextafter(x, y))
      BINARY(EQ, x == y)
      BINARY(NE, x != y)
      BINARY(LT, x < y)
      BINARY(LE, x <= y)
      BINARY(GT, x > y)
      BINARY(GE, x >= y)
      BINARY(EQ_TO, in_order(x) == in_order(y))
      BINARY(LT_TO, in_order(x) < in_order(y))
      BINARY(LE_TO, in_order(x) <= in_order(y))
      BINARY(AND, exactly(m, whole(x) & whole(y), i->x0))
      BINARY(OR, exactly(m, whole(x) | whole(y), i->x0))
      BINARY(XOR, exactly(m, whole(x) ^ whole(y), i->x0))
      BINARY(IADD, exactly(m, (int64_t)((uint64_t)whole(x) + (uint64_t)whole(y)), i->x0))
      BINARY(ISUB, exactly(m, (int64_t)((uint64_t)whole(x) - (uint64_t)whole(y)), i->x0))
      BINARY(IMUL, exactly(m, (int64_t)((uint64_t)whole(x) * (uint64_t)whole(y)), i->x0))
      BINARY(IDIV, exactly(m, quotient(whole(x), whole(y)), i->x0))
      BINARY(IREM, exactly(m, remainder_of(whole(x), whole(y)), i->x0))
    case SELECT: { /* a is the predicate; b where it is false, c where it is true */
      const int sb = (i->splat & 2) != 0, sc = (i->splat & 4) != 0;
      if (i->splat & 1)
        copy(o, *a != 0.0 ? c : b, n, *a != 0.0 ? sc : sb);
      else
        for (int64_t k = 0; k < n; k++) o[k] = a[k] != 0.0 ? c[sc ? 0 : k] : b[sb ? 0 : k];
      break;
    }
    case CLAMP: { /* b between a and c */
      const int sa = (i->splat & 1) != 0, sb = (i->splat & 2) != 0, sc = (i->splat & 4) != 0;
      for (int64_t k = 0; k < n; k++) {
        o[k] = smaller(larger(b[sb ? 0 : k], a[sa ? 0 : k]), c[sc ? 0 : k]);
      }
      break;
    }
    case TAKE:
      for (int64_t k = 0; k < n; k++) o[k] = a[t[k]];
      break;
    case PAD: /* b is the padding; places below zero take it */
      for (int64_t k = 0; k < n; k++) o[k] = t[k] < 0 ? *b : a[t[k]];
      break;
    case JOIN: /* x0 parts: place, splat, rows, length of a row, start, stride of rows in the result */
      for (int64_t q = 0; q < i->x0; q++, t += 6) {
        const double *from = M + t[0];
        for (int64_t r = 0; r < t[2]; r++, from += t[1] ? 0 : t[3]) copy(o + t[4] + r * t[5], from, t[3], t[1] != 0);
      }
      break;
    case SLICE: { /* x0 axes with an index; then the places, or contiguous where mode is 1 */
      const double *from = a + slice_start(t, i->x0, M);
      t += 3 * i->x0;
      if (i->mode)
        copy(o, from, n, 0);
      else
        for (int64_t k = 0; k < n; k++) o[k] = from[t[k]];
      break;
    }
    case UPDATE: { /* a with x1 numbers of b written into it */
      copy(o, a, n, 0);
      o += slice_start(t, i->x0, M);
      t += 3 * i->x0;
      if (i->mode)
        copy(o, b, i->x1, (i->splat & 2) != 0);
      else
        for (int64_t k = 0; k < i->x1; k++) o[t[k]] = b[i->splat & 2 ? 0 : k];
      break;
    }
    case GATHER: /* x0 rows by x1 indices of b; windows of x2; c is what stands for rows out of range where mode is 1 */
    case SCATTER: { /* the same of updates c into a; mode 1 leaves rows out of range out, x3 is how they are combined */
      const int64_t rows = i->x0, dims = i->x1, width = i->x2;
      const int32_t *base = t + 2 * dims, *row_place = base + rows, *window = row_place + rows, *window_place = window + width;
      if (i->op == SCATTER) copy(o, a, n, 0);
      for (int64_t r = 0; r < rows; r++) {
        int is_good;
        const int64_t start = base[r] + row_start(t, dims, b + r * dims, &is_good);
        const int is_out = i->mode && !is_good;
        if (i->op == GATHER) {
          double *to = o + row_place[r];
          for (int64_t k = 0; k < width; k++) to[window_place[k]] = is_out ? *c : a[start + window[k]];
        } else if (!is_out)
          for (int64_t k = 0; k < width; k++) {
            double *to = o + start + window[k];
            const double x = *to, y = c[i->splat & 4 ? 0 : row_place[r] + window_place[k]];
            *to = i->x3 == 0 ? y : i->x3 == 1 ? x + y : i->x3 == 2 ? x * y : i->x3 == 3 ? smaller(x, y) : larger(x, y);
          }
      }
      break;
    }
      REDUCE(SUM, 0.0, r + x)
      REDUCE(PROD, 1.0, r *x)
      REDUCE(RMAX, -INFINITY, larger(r, x))
      REDUCE(RMIN, INFINITY, smaller(r, x))
      REDUCE(ALL, 1.0, r != 0.0 && x != 0.0)
      REDUCE(ANY, 0.0, r != 0.0 || x != 0.0)
      ARGUMENT(ARGMAX, x > y)
      ARGUMENT(ARGMIN, x < y)
      CUMULATIVE(CUMSUM, r + x)
      CUMULATIVE(CUMPROD, r *x)
      CUMULATIVE(CUMMAX, larger(r, x))
      CUMULATIVE(CUMMIN, smaller(r, x))
    case SORT: { /* x0 arrays (outer, x1, x2) from t one after another by x3 keys; then to; c: 3 x1 numbers to work in */
      const int64_t K = i->x1, inner = i->x2, arrays = i->x0;
      int64_t *order = (int64_t *)(M + i->c), *spare = order + K;
      double *row = M + i->c + 2 * K;
      for (int64_t p = 0; p < n / (K * inner); p++)
        for (int64_t q = 0; q < inner; q++) {
          const int64_t at = p * K * inner + q;
          merge_sort(order, spare, K, a + at, inner, i->x3, n);
          for (int64_t array = 0; array < arrays; array++) {
            const double *from = a + array * n + at;
            for (int64_t k = 0; k < K; k++) row[k] = from[order[k] * inner];
            for (int64_t k = 0; k < K; k++) o[array * n + at + k * inner] = row[k];
          }
        }
      break;
    }
    case DOT:
    case DOT_TABLE: m->products(i, t, o, a, b); break;
    case CHOLESKY:
      copy(o, a, n, 0);
      cholesky(o, i->x0, i->x1);
      break;
    case TRIANGULAR: /* x0 systems of x1 unknowns and x2 right sides b; mode: 1 lower, 2 transposed, 4 unit, 8 from right */
      copy(o, b, n, 0);
      for (int64_t z = 0; z < i->x0; z++, o += i->x1 * i->x2, a += i->x1 * i->x1) {
        const int is_right = (i->mode & 8) != 0, is_transposed = ((i->mode & 2) != 0) != is_right;
        triangular(o, a, i->x1, i->x2, is_right ? 1 : i->x2, is_right ? i->x1 : 1, i->mode & 1, is_transposed, (i->mode & 4) != 0);
      }
      break;
    case LU: { /* x0 matrices (x1, x2); pivots go to b, permutations to c */
      const int64_t R = i->x1, C = i->x2;
      copy(o, a, n, 0);
      for (int64_t z = 0; z < i->x0; z++) lu(o + z * R * C, M + i->b + z * (R < C ? R : C), M + i->c + z * R, R, C);
      break;
    }
    case WHILE: /* a is what tape x0 leaves as condition; x1 is the body */
      for (run(m, i->x0); *a != 0.0; run(m, i->x0)) run(m, i->x1);
      break;
    case SCAN: { /* n turns of tape x0, backwards where mode is 1; x1 inputs and x2 outputs: (stack, row, length, splat) */
      for (int64_t turn = 0; turn < n; turn++) {
        const int64_t k = i->mode ? n - 1 - turn : turn;
        const int32_t *row = t;
        for (int64_t q = 0; q < i->x1; q++, row += 4) copy(M + row[1], M + row[0] + k * row[2], row[2], 0);
        run(m, i->x0);
        for (int64_t q = 0; q < i->x2; q++, row += 4) copy(M + row[0] + k * row[2], M + row[1], row[2], row[3] != 0);
      }
      break;
    }
    case COND: /* the tape of x0 that a names */
      run(m, t[clamped(*a, i->x0 - 1)]);
      break;
    case HOST: m->host(i - m->code, M); break;
  }
}

static void run(const Machine *m, int64_t tape) {
  const Instruction *end = m->code + m->starts[tape + 1];
  for (const Instruction *i = m->code + m->starts[tape]; i < end; i++) step(m, i);
}

void tape_run(const Instruction *code, const int32_t *starts, const int32_t *tables, double *arena, Host host) {
  Machine m = {code, starts, tables, arena, host, IS_WIDE ? products_wide : products_plain};
  run(&m, 0);
}
