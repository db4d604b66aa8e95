#pragma once
// The one covariance: row and column moves and low-rank changes, each linear in its size. Nothing here is n x n x n.

#include "fsw/estimator/error_state.h"
#include "fsw/math/matrix.h"

namespace plumb {

/// x[to..] becomes a copy of x[from..]: cloning.
void clone_block(MatrixView p, std::size_t from, std::size_t to, std::size_t count);

/// Removes all knowledge of x[at..] and all correlation with it.
void clear_block(MatrixView p, std::size_t at, std::size_t count);

/// x[to..] <- x[from..], then x[from..] is cleared: closes the gap that a removed feature leaves.
void move_block(MatrixView p, std::size_t from, std::size_t to, std::size_t count);

/// x[at..at+rows) <- J x + w with w of covariance `noise` (rows x rows). J is rows x n, zero outside `support`, and may
/// read x[at..] itself. Used for re-anchoring and for features started from their observations. rows <= 3.
void assign_linear(MatrixView p, std::size_t at, ConstMatrixView jacobian, const Support& support, const Mat3& noise);

/// x[at..at+rows) <- x[at..at+rows) + J x[from..from+cols), J rows x cols, the two ranges apart. rows <= 9.
void add_linear(MatrixView p, std::size_t at, ConstMatrixView jacobian, std::size_t from);

/// x[at..at+3) <- rotation x[at..at+3).
void rotate_block(MatrixView p, std::size_t at, const Mat3& rotation);

/// out(row) <- J(row) P for rows whose non-zero columns are `support`.
void multiply_rows(ConstMatrixView jacobian, const Support& support, ConstMatrixView p, MatrixView out);

/// out(r) <- the sum of a(r, c) row[c] over the columns of `support`, for every row of a. `out` is one column of at
/// most kMaxProducts rows. What H P H^T is made of: rows of H P times a row of H.
inline constexpr std::size_t kMaxProducts = 512;
void sum_products(ConstMatrixView a, const double* row, const Support& support, MatrixView out);

/// P <- Phi P Phi^T + Q on the 15 core states, and Phi on the cross terms. Rows of Phi for the biases are identity.
void propagate_core(MatrixView p, const Mat15& phi, const Mat15& q);

/// Converts the core block from the right-invariant error to the published one (nav_state.h).
Mat15 to_nav_covariance(ConstMatrixView p, const Quat& q_WI, const Vec3& p_WI, const Vec3& v_WI);

}  // namespace plumb
