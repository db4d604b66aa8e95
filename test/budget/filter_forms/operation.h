#pragma once
// What a filter does to its covariance, one operation after the other, as the flight software does it
// (fsw/estimator/covariance.h, update_stack.h). Any form of the filter can repeat them.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "fsw/estimator/update_stack.h"

namespace plumb::budget {

using Layout = ErrorLayout<FlightConfig>;

template <typename T>
using Table = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Rows of the largest update there is.
inline constexpr std::size_t kMaxRows = UpdateStack<FlightConfig>::kMaxRows;

inline Eigen::Index index(std::size_t i) { return static_cast<Eigen::Index>(i); }

enum class Kind : std::uint8_t {
  kRestart,    ///< everything is replaced by the covariance `a`
  kPrior,      ///< x[at..at+3), which was clear, gets the covariance `a`
  kClear,      ///< x[at..at+count) is forgotten
  kClone,      ///< x[at..at+count) <- x[from..]
  kMove,       ///< the same, and x[from..] is forgotten
  kAssign,     ///< x[at..at+rows) <- a x + w, w of covariance `b`
  kPropagate,  ///< x[0..15) <- a x[0..15) + w, w of covariance `b`
  kUpdate,     ///< residual = a x + noise of unit variance
};

template <typename T>
struct Operation {
  Kind kind = Kind::kRestart;
  std::size_t size = 0;  ///< states there are from this operation on; those behind are gone
  std::size_t at = 0;
  std::size_t from = 0;
  std::size_t count = 0;
  Table<T> a{};
  Table<T> b{};
  Table<T> root{};                    ///< of kRestart's `a` and kAssign's `b`: root^T root, see set_root()
  std::vector<Support> supports{};    ///< the columns of each row of `a` that are not zero
  std::vector<std::size_t> groups{};  ///< the rows of an update that are multiplied together: how many in each group
  std::vector<T> residual{};

  template <typename U>
  Operation<U> cast() const {
    return {kind,
            size,
            at,
            from,
            count,
            a.template cast<U>(),
            b.template cast<U>(),
            root.template cast<U>(),
            supports,
            groups,
            std::vector<U>(residual.begin(), residual.end())};
  }
};

/// The upper triangular root of p = root^T root. A direction without variance gets a zero row.
template <typename T>
Table<T> upper_root(const Table<T>& p) {
  constexpr T kNothing = 8 * std::numeric_limits<T>::epsilon();  // of the diagonal element: rounding
  const Eigen::Index n = p.rows();
  Table<T> root = Table<T>::Zero(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    root.row(k).tail(n - k) = p.row(k).tail(n - k);
    for (Eigen::Index i = 0; i < k; ++i) root.row(k).tail(n - k) -= root(i, k) * root.row(i).tail(n - k);
    const T pivot = root(k, k);
    root.row(k) *= pivot > kNothing * p(k, k) ? 1 / std::sqrt(pivot) : T(0);
  }
  return root;
}

/// A filter of roots has the root of what a feature or the filter starts with before anything is squared, and does not
/// lose digits to that.
inline void set_root(Operation<double>& operation, const Table<double>& p) {
  operation.root = upper_root<long double>(p.cast<long double>()).cast<double>();
}

/// Whether every column of `inner` is one of `outer`.
inline bool within(const Support& inner, const Support& outer) {
  return std::all_of(inner.begin(), inner.end(), [&outer](const Segment& i) {
    return std::any_of(outer.begin(), outer.end(), [&i](const Segment& o) {
      return o.start <= i.start && i.start + i.length <= o.start + o.length;
    });
  });
}

/// Groups of up to four rows whose columns are among those of the first, as the flight software multiplies them.
inline std::vector<std::size_t> groups_of(const std::vector<Support>& supports) {
  constexpr std::size_t kTogether = 4;
  std::vector<std::size_t> groups;
  for (std::size_t row = 0; row < supports.size(); row += groups.back()) {
    std::size_t count = 1;
    while (count < kTogether && row + count < supports.size() && within(supports[row + count], supports[row])) ++count;
    groups.push_back(count);
  }
  return groups;
}

}  // namespace plumb::budget
