/* Multifrontal L D L^T of a sparse symmetric matrix by dense blocks, and solves with it.

   Columns with nearly the same pattern are one supernode. Its columns of L are a dense panel,
   stored by columns, the diagonal block on top; what it subtracts from later columns is a dense
   update matrix, which its parent in the elimination tree adds up (Duff and Reid 1983; Liu 1992).
   No pivoting: the signs of D are the matrix's inertia. */
#include <stdlib.h>

#include "lanes.h"

/* The symbolic factorisation, by the names of equilibrium/supernodes.py; rows and columns in the
 * order of elimination. */
typedef struct {
    int64_t n, n_supernodes;
    const int64_t *first;     /* (n_supernodes + 1,) columns */
    const int64_t *row_start; /* (n_supernodes + 1,) into rows and in_parent */
    const int32_t *rows;      /* rows below the diagonal block */
    const int32_t *in_parent; /* their places in the parent's front */
    const int32_t *children;  /* (n_supernodes,) how many, all finished just before their parent */
    const int64_t *panel_start; /* (n_supernodes + 1,) into the panels */
    const int64_t *entry_start; /* (n_supernodes + 1,) into entry_from and entry_to */
    const int32_t *entry_from;  /* the matrix's entries by supernode: places in its values */
    const int64_t *entry_to;    /* and in the panels */
    int64_t stack_size;         /* doubles of stacked updates */
    int64_t widest, tallest;    /* columns, and rows below, of a supernode */
} Supernodes;

#define PADDED(m) (((m) + LANES - 1) / LANES * LANES)
#define COLUMNS 64 /* right-hand sides of a block, as in equilibrium/block_solve.py */
#define STEP 8     /* columns of a panel that are eliminated before the others catch up */

INLINE lanes load(const double *from) { return *(const lanes_u *)from; }
INLINE void store(double *to, lanes x) { *(lanes_u *)to = x; }

/* c_q[0:4 width] -= sum_p b_p[0:4 width] w[p step + q next], q < count: all of the level-3 work. */
INLINE void subtract_products(double *const *c, int count, int width, const double *b, int64_t ldb,
                              const double *w, int64_t step, int64_t next, int64_t depth)
{
    lanes sum[4][8];
    for (int q = 0; q < count; q++)
        for (int i = 0; i < width; i++)
            sum[q][i] = load(c[q] + LANES * i);
    for (int64_t p = 0; p < depth; p++)
        for (int q = 0; q < count; q++)
            for (int i = 0; i < width; i++)
                sum[q][i] -= load(b + p * ldb + LANES * i) * w[p * step + q * next];
    for (int q = 0; q < count; q++)
        for (int i = 0; i < width; i++)
            store(c[q] + LANES * i, sum[q][i]);
}

/* C -= B W on and below the diagonal, which begins in row `top`, of n columns; C and B have
   `height` rows. Tiles of rows end with the columns, and may begin up to LANES - 1 rows above the
   diagonal. */
static void subtract_lower(double *C, int64_t ldc, int64_t n, int64_t height, const double *B,
                           int64_t ldb, const double *W, int64_t ldw, int64_t depth, int64_t top)
{
    for (int64_t j = 0; j < n; j += 4) {
        double *at[4];
        int count = n - j < 4 ? (int)(n - j) : 4;
        for (int64_t i = height - PADDED(height - top - j); i < height;) {
            int wide = height - i >= 2 * LANES;
            for (int q = 0; q < count; q++)
                at[q] = C + (j + q) * ldc + i;
            if (count == 4 && wide)
                subtract_products(at, 4, 2, B + i, ldb, W + j, ldw, 1, depth);
            else if (count == 4)
                subtract_products(at, 4, 1, B + i, ldb, W + j, ldw, 1, depth);
            else if (count == 2 && wide)
                subtract_products(at, 2, 2, B + i, ldb, W + j, ldw, 1, depth);
            else if (count == 2)
                subtract_products(at, 2, 1, B + i, ldb, W + j, ldw, 1, depth);
            else
                for (int q = 0; q < count; q++) {
                    if (wide)
                        subtract_products(at + q, 1, 2, B + i, ldb, W + j + q, ldw, 1, depth);
                    else
                        subtract_products(at + q, 1, 1, B + i, ldb, W + j + q, ldw, 1, depth);
                }
            i += wide ? 2 * LANES : LANES;
        }
    }
}

/* L D L^T of a panel (height x k), in place; D apart. Returns 1 if a pivot is exactly zero. W is
 * scratch. */
static int factorise_panel(double *P, int64_t k, int64_t height, double *D, double *W)
{
    for (int64_t begin = 0; begin < k; begin += STEP) {
        int64_t end = begin + STEP < k ? begin + STEP : k;
        for (int64_t j = begin; j < end; j++) {
            double *own = P + j * height, pivot = own[j];
            if (pivot == 0.0)
                return 1;
            D[j] = pivot;
            double inverse = 1.0 / pivot;
            for (int64_t c = j + 1; c < end; c++) {
                double *other = P + c * height, factor = own[c] * inverse;
                for (int64_t i = c; i < height; i++)
                    other[i] -= own[i] * factor;
            }
            for (int64_t i = j + 1; i < height; i++)
                own[i] *= inverse;
        }
        if (end == k)
            break;
        int64_t rest = k - end;
        for (int64_t p = begin; p < end; p++)
            for (int64_t c = 0; c < rest; c++)
                W[(p - begin) * rest + c] = P[p * height + end + c] * D[p];
        /* tiles of rows end with the panel, and may begin above the diagonal, where nothing is kept
         */
        subtract_lower(P + end * height, height, rest, height, P + begin * height, height, W, rest,
                       end - begin, end);
    }
    return 0;
}

/* Factorise the matrix of these values into panels and pivots D, until more than `most` pivots are
   not positive. Returns 0, 1 for a zero pivot, 2 when it stopped, -1 without memory. */
int factorise(const Supernodes *s, const double *values, double *panels, double *D, int64_t most)
{
    double *stack = malloc(
        sizeof(double) * (s->stack_size + (s->widest + LANES) * PADDED(s->tallest + s->widest)));
    if (!stack)
        return -1;
    double *W = stack + s->stack_size;
    int64_t top = 0, bad = 0;
    int status = 0;
    int64_t n_open = 0, *open = malloc(sizeof(int64_t) * (s->n_supernodes + 1)); /* with updates */
    if (!open) {
        free(stack);
        return -1;
    }
    for (int64_t t = 0; t < s->n_supernodes && !status; t++) {
        int64_t k = s->first[t + 1] - s->first[t], m = s->row_start[t + 1] - s->row_start[t];
        int64_t padded = PADDED(m), height = k + padded;
        double *P = panels + s->panel_start[t], *U = stack + top;
        memset(P, 0, sizeof(double) * height * k);
        memset(U, 0, sizeof(double) * padded * m);
        for (int64_t a = s->entry_start[t]; a < s->entry_start[t + 1]; a++)
            panels[s->entry_to[a]] += values[s->entry_from[a]];
        for (int64_t c = 0; c < s->children[t]; c++) {
            int64_t child = open[--n_open], mc = s->row_start[child + 1] - s->row_start[child];
            const int32_t *to = s->in_parent + s->row_start[child];
            top -= PADDED(mc) * mc;
            for (int64_t j = 0; j < mc; j++) {
                const double *from = stack + top + j * PADDED(mc);
                double *column = to[j] < k ? P + to[j] * height : U + (to[j] - k) * padded - k;
                for (int64_t i = j; i < mc; i++)
                    column[to[i]] += from[i];
            }
        }
        status = factorise_panel(P, k, height, D + s->first[t], W);
        for (int64_t j = s->first[t]; j < s->first[t + 1] && !status; j++)
            bad += !(D[j] > 0);
        if (!status && bad > most)
            status = 2;
        if (m && !status) {
            for (int64_t p = 0; p < k; p++)
                for (int64_t j = 0; j < m; j++)
                    W[p * padded + j] = P[p * height + k + j] * D[s->first[t] + p];
            subtract_lower(U, padded, m, padded, P + k, height, W, padded, k, 0);
            memmove(stack + top, U, sizeof(double) * padded * m);
            top += padded * m;
            open[n_open++] = t;
        }
    }
    free(open);
    free(stack);
    return status;
}

/* Solve L D L^T x = b in place, b (n,) in the order of elimination; work (tallest,). */
void solve(const Supernodes *s, const double *panels, const double *D, double *x, double *work)
{
    for (int64_t t = 0; t < s->n_supernodes; t++) {
        int64_t k = s->first[t + 1] - s->first[t], m = s->row_start[t + 1] - s->row_start[t],
                height = k + PADDED(m);
        const double *P = panels + s->panel_start[t];
        const int32_t *rows = s->rows + s->row_start[t];
        double *own = x + s->first[t];
        memset(work, 0, sizeof(double) * m);
        for (int64_t p = 0; p < k; p++, P += height) {
            for (int64_t i = p + 1; i < k; i++)
                own[i] -= P[i] * own[p];
            for (int64_t i = 0; i < m; i++)
                work[i] += P[k + i] * own[p];
        }
        for (int64_t i = 0; i < m; i++)
            x[rows[i]] -= work[i];
    }
    for (int64_t i = 0; i < s->n; i++)
        x[i] /= D[i];
    for (int64_t t = s->n_supernodes - 1; t >= 0; t--) {
        int64_t k = s->first[t + 1] - s->first[t], m = s->row_start[t + 1] - s->row_start[t],
                height = k + PADDED(m);
        const int32_t *rows = s->rows + s->row_start[t];
        double *own = x + s->first[t];
        for (int64_t i = 0; i < m; i++)
            work[i] = x[rows[i]];
        for (int64_t p = k - 1; p >= 0; p--) {
            const double *P = panels + s->panel_start[t] + p * height;
            lanes total = {0};
            double sum = 0.0;
            int64_t i = 0;
            for (; i + LANES <= m; i += LANES)
                total += load(P + k + i) * load(work + i);
            for (; i < m; i++)
                sum += P[k + i] * work[i];
            for (i = p + 1; i < k; i++)
                sum += P[i] * own[i];
            own[p] -= sum + (total[0] + total[1]) + (total[2] + total[3]);
        }
    }
}

/* Row r of a block of right-hand sides -= sum of `depth` rows from b on, times weights w[p step + q
 * next]; `count` rows. */
INLINE void subtract_rows(double *const *c, int count, const double *b, const double *w,
                          int64_t step, int64_t next, int64_t depth)
{
    const int width = count == 1 ? 8 : count == 2 ? 4 : 2; /* sums that don't wait for each other */
    for (int64_t i = 0; i < COLUMNS; i += width * LANES) {
        double *at[4];
        for (int q = 0; q < count; q++)
            at[q] = c[q] + i;
        subtract_products(at, count, width, b + i, COLUMNS, w, step, next, depth);
    }
}

static void subtract_up_to_four(double *const *c, int64_t count, const double *b, const double *w,
                                int64_t step, int64_t next, int64_t depth)
{
    if (count == 4)
        subtract_rows(c, 4, b, w, step, next, depth);
    else if (count == 3)
        subtract_rows(c, 3, b, w, step, next, depth);
    else if (count == 2)
        subtract_rows(c, 2, b, w, step, next, depth);
    else
        subtract_rows(c, 1, b, w, step, next, depth);
}

/* Forward and backward substitution for a block X (n, COLUMNS); `reached` says which supernodes the
 * first one needs. */
static void substitute(const Supernodes *s, const double *panels, const double *D,
                       const int32_t *supernode_of, uint8_t *reached, double *X, double *gathered)
{
    double *at[4];
    for (int64_t t = 0; t < s->n_supernodes; t++) {
        if (!reached[t])
            continue;
        int64_t k = s->first[t + 1] - s->first[t], m = s->row_start[t + 1] - s->row_start[t],
                height = k + PADDED(m);
        const double *P = panels + s->panel_start[t];
        const int32_t *rows = s->rows + s->row_start[t];
        double *own = X + s->first[t] * COLUMNS;
        for (int64_t i = 0; i < k; i += 4) {
            int64_t count = k - i < 4 ? k - i : 4;
            for (int64_t q = 0; q < count; q++)
                at[q] = own + (i + q) * COLUMNS;
            subtract_up_to_four(at, count, own, P + i, height, 1, i);
            for (int64_t q = 1; q < count; q++)
                subtract_rows(at + q, 1, at[0], P + i * height + i + q, height, 1, q);
        }
        for (int64_t i = 0; i < m; i += 4) {
            int64_t count = m - i < 4 ? m - i : 4;
            for (int64_t q = 0; q < count; q++)
                at[q] = X + rows[i + q] * (int64_t)COLUMNS;
            subtract_up_to_four(at, count, own, P + k + i, height, 1, k);
        }
        if (m)
            reached[supernode_of[rows[0]]] = 1; /* the parent, and by it all rows' supernodes */
    }
    for (int64_t t = s->n_supernodes - 1; t >= 0; t--) {
        int64_t k = s->first[t + 1] - s->first[t], m = s->row_start[t + 1] - s->row_start[t],
                height = k + PADDED(m);
        const double *P = panels + s->panel_start[t];
        const int32_t *rows = s->rows + s->row_start[t];
        double *own = X + s->first[t] * COLUMNS;
        for (int64_t p = 0; p < k; p++)
            for (int64_t c = 0; c < COLUMNS; c += LANES)
                store(own + p * COLUMNS + c, load(own + p * COLUMNS + c) / D[s->first[t] + p]);
        for (int64_t i = 0; i < m; i++)
            for (int64_t c = 0; c < COLUMNS; c += LANES)
                store(gathered + i * COLUMNS + c, load(X + rows[i] * (int64_t)COLUMNS + c));
        for (int64_t p = 0; p < k; p += 4) {
            int64_t count = k - p < 4 ? k - p : 4;
            for (int64_t q = 0; q < count; q++)
                at[q] = own + (p + q) * COLUMNS;
            subtract_up_to_four(at, count, gathered, P + p * height + k, 1, height, m);
        }
        for (int64_t p = (k - 1) / 4 * 4; p >= 0; p -= 4) {
            int64_t count = k - p < 4 ? k - p : 4, end = p + count;
            for (int64_t q = 0; q < count; q++)
                at[q] = own + (p + q) * COLUMNS;
            subtract_up_to_four(at, count, own + end * COLUMNS, P + p * height + end, 1, height,
                                k - end);
            for (int64_t q = count - 2; q >= 0; q--)
                subtract_rows(at + q, 1, at[q + 1], P + (p + q) * height + p + q + 1, 1, 0,
                              count - 1 - q);
        }
    }
}

/* Solve for sparse right-hand sides (compressed columns; rows in the order of elimination), COLUMNS
   of them at a time: blocks (n_blocks, n, COLUMNS).

   With n_constrained rows of a constraint c, their shares c_i / (c.A^-1 c) and column = A^-1 c,
   every solution loses (shares.solution) column. Returns -1 without memory. */
int solve_columns(const Supernodes *s, const double *panels, const double *D, int64_t count,
                  const int32_t *rhs_start, const int32_t *rhs_rows, const double *rhs_values,
                  int64_t n_constrained, const int64_t *constrained, const double *shares,
                  const double *column, double *blocks)
{
    int32_t *supernode_of = malloc(sizeof(int32_t) * (s->n + 1));
    uint8_t *reached = malloc(s->n_supernodes + 1);
    double *gathered = malloc(sizeof(double) * COLUMNS * (s->tallest + 1));
    int failed = !supernode_of || !reached || !gathered;
    for (int64_t t = 0; t < s->n_supernodes && !failed; t++)
        for (int64_t j = s->first[t]; j < s->first[t + 1]; j++)
            supernode_of[j] = (int32_t)t;
    for (int64_t first = 0; first < count && !failed; first += COLUMNS) {
        double *X = blocks + first * s->n;
        memset(X, 0, sizeof(double) * COLUMNS * s->n);
        memset(reached, 0, s->n_supernodes);
        for (int64_t c = 0; c < COLUMNS && first + c < count; c++)
            for (int32_t a = rhs_start[first + c]; a < rhs_start[first + c + 1]; a++) {
                X[rhs_rows[a] * (int64_t)COLUMNS + c] += rhs_values[a];
                reached[supernode_of[rhs_rows[a]]] = 1;
            }
        substitute(s, panels, D, supernode_of, reached, X, gathered);
        if (!n_constrained)
            continue;
        double multiplier[COLUMNS] = {0};
        for (int64_t a = 0; a < n_constrained; a++)
            for (int64_t c = 0; c < COLUMNS; c++)
                multiplier[c] += shares[a] * X[constrained[a] * COLUMNS + c];
        for (int64_t i = 0; i < s->n; i++)
            for (int64_t c = 0; c < COLUMNS; c++)
                X[i * COLUMNS + c] -= column[i] * multiplier[c];
    }
    free(supernode_of);
    free(reached);
    free(gathered);
    return -failed;
}

/* out (m, count) = a sparse matrix (m, n; compressed rows, columns as places in the blocks) times
 * the solutions. */
void multiply_blocks(int64_t m, const int32_t *indptr, const int64_t *places, const double *data,
                     int64_t n, int64_t count, const double *blocks, double *out)
{
    for (int64_t first = 0; first < count; first += COLUMNS) {
        int64_t width = count - first < COLUMNS ? count - first : COLUMNS;
        for (int64_t i = 0; i < m; i++) {
            double sum[COLUMNS];
            for (int64_t c = 0; c < COLUMNS; c += 4 * LANES) {
                lanes part[4] = {{0}};
                for (int32_t a = indptr[i]; a < indptr[i + 1]; a++) {
                    const double *row = blocks + first * n + places[a] * COLUMNS + c;
                    for (int k = 0; k < 4; k++)
                        part[k] += data[a] * load(row + LANES * k);
                }
                for (int k = 0; k < 4; k++)
                    store(sum + c + LANES * k, part[k]);
            }
            memcpy(out + i * count + first, sum, sizeof(double) * width);
        }
    }
}
