#pragma once
// The filter's dense linear algebra, in place and in one fixed order of operations.

#include "fsw/base/status.h"
#include "fsw/math/matrix.h"

namespace plumb {

/// Sum of a[i] * b[i].
double dot(const double* a, const double* b, std::size_t n);

/// out[r] <- dot(a.row(r), b, a.cols()) for every row of a, bit for bit.
void dot_rows(ConstMatrixView a, const double* b, double* out);

/// out <- out + a x, every element summed in the order of the columns of a. `out` overlaps neither.
void add_product(ConstMatrixView a, ConstMatrixView x, MatrixView out);

/// out <- out - a x, likewise.
void subtract_product(ConstMatrixView a, ConstMatrixView x, MatrixView out);

/// a <- lower-triangular L with a = L L^T; only the lower triangle is read and written.
/// kNumericalFault (a half-written) when a is not positive definite or not finite.
Status cholesky_in_place(MatrixView a);

/// b <- L^-1 b for lower-triangular l.
void solve_lower_in_place(ConstMatrixView l, MatrixView b);

/// x <- L^-T x for lower-triangular l and one vector of l.rows() elements.
void solve_lower_transposed_in_place(ConstMatrixView l, double* x);

/// p <- p - w^T w for symmetric p (n x n) and w (m x n). Both triangles are written, equal bit for bit.
void subtract_gram(MatrixView p, ConstMatrixView w);

/// a <- factor a.
void scale_in_place(MatrixView a, double factor);

/// Copies the lower triangle onto the upper one.
void mirror_lower(MatrixView p);

/// Left-multiplies a by an orthogonal matrix (Householder reflections) that makes its first `columns` columns upper
/// triangular. Row k of the triangle stands in row k of a. Everything right of those columns is carried along.
void triangularise(MatrixView a, std::size_t columns);

/// Rows that fold_rows() and triangularise() can take at once: two for each of 32 poses, and a range.
inline constexpr std::size_t kMaxFoldRows = 65;

/// Folds the rows of `b` into the upper-triangular `r` (r.cols() == b.cols(), r has at least `columns` rows), so that
/// r^T r grows by b^T b in exact arithmetic. b is destroyed. The last columns past `columns` are carried along.
/// Precondition: at most kMaxFoldRows rows in b.
void fold_rows(MatrixView r, MatrixView b, std::size_t columns);

}  // namespace plumb
