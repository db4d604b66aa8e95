#include "test/budget/filter_forms/operation_recorder.h"

#include <utility>

#include "fsw/estimator/covariance.h"
#include "fsw/math/kernels.h"

namespace plumb::budget {
namespace {

Table<double> table(ConstMatrixView view) {
  Table<double> out(index(view.rows()), index(view.cols()));
  for (std::size_t r = 0; r < view.rows(); ++r) std::copy_n(view.row(r), view.cols(), &out(index(r), 0));
  return out;
}

}  // namespace

OperationRecorder& OperationRecorder::instance() {
  static OperationRecorder recorder;
  return recorder;
}

std::vector<Operation<double>> OperationRecorder::take() {
  if (filter_ != nullptr) find_direct_writes(filter_->covariance());
  return std::exchange(operations_, {});
}

Operation<double>& OperationRecorder::add(Kind kind, std::size_t size) {
  operations_.emplace_back();
  operations_.back().kind = kind;
  operations_.back().size = size;
  return operations_.back();
}

void OperationRecorder::after(ConstMatrixView p) {
  size_ = p.rows();
  for (std::size_t r = 0; r < p.rows(); ++r) std::copy_n(p.row(r), p.cols(), copy_.view().row(r));
}

/// The block of a new feature, or a new start.
void OperationRecorder::find_direct_writes(ConstMatrixView p) {
  const std::size_t known = std::min(size_, p.rows());
  std::size_t first = size_ == 0 ? 0 : known;  // of a filter that was never seen, everything is new
  std::size_t last = 0;
  for (std::size_t r = 0; r < known; ++r) {
    for (std::size_t c = 0; c < known; ++c) {
      if (p(r, c) == copy_.view()(r, c)) continue;
      first = std::min({first, r, c});
      last = std::max({last, r, c});
    }
  }
  if (first > last) return;
  const bool cleared = !operations_.empty() && operations_.back().kind == Kind::kClear;
  const std::size_t at = cleared ? operations_.back().at : 0;
  if (cleared && at >= Layout::kFeatures && first >= at && last < at + kFeatureSize) {
    Operation<double>& prior = add(Kind::kPrior, p.cols());
    prior.at = at;
    prior.a = table(p.block(at, at, kFeatureSize, kFeatureSize));
  } else {
    Operation<double>& restart = add(Kind::kRestart, p.cols());
    restart.a = table(p);
    set_root(restart, restart.a);
  }
  after(p);
}

void OperationRecorder::add_row(ConstMatrixView products, const double* row, const Support& support) {
  if (filter_ == nullptr || products.cols() != filter_->size()) return;  // rows of a track see the poses alone
  rows_.emplace_back(row, row + products.cols());
  supports_.push_back(support);
}

void OperationRecorder::see_residual(ConstMatrixView r) {
  if (filter_ != nullptr && r.cols() == 1) residual_.assign(r.data(), r.data() + r.rows());
}

/// The last rows that were seen are those of the update: what came before belongs to others that were given up.
void OperationRecorder::add_update(ConstMatrixView p, std::size_t rows) {
  const std::size_t skipped = rows_.size() - rows;
  Operation<double>& update = add(Kind::kUpdate, p.cols());
  update.a.resize(index(rows), index(p.cols()));
  for (std::size_t r = 0; r < rows; ++r) {
    // What stands outside the support is of an earlier update and not read.
    update.a.row(index(r)).setZero();
    for (const Segment& s : supports_[skipped + r])
      std::copy_n(rows_[skipped + r].data() + s.start, s.length, &update.a(index(r), index(s.start)));
  }
  update.supports.assign(supports_.begin() + static_cast<std::ptrdiff_t>(skipped), supports_.end());
  update.groups = groups_of(update.supports);
  update.residual = residual_;
  rows_.clear();
  supports_.clear();
}

}  // namespace plumb::budget

// The seam. "real" is the function that flies, "wrapped" what the estimator calls in its place.
#define PLUMB_SEAM(result, name, mangled, parameters)   \
  result real_##name parameters asm("__real_" mangled); \
  result wrapped_##name parameters asm("__wrap_" mangled)

namespace plumb::budget {

PLUMB_SEAM(void, clone, "_ZN5plumb11clone_blockENS_15BasicMatrixViewIdEEmmm",
           (MatrixView p, std::size_t from, std::size_t to, std::size_t count));
PLUMB_SEAM(void, move, "_ZN5plumb10move_blockENS_15BasicMatrixViewIdEEmmm",
           (MatrixView p, std::size_t from, std::size_t to, std::size_t count));
PLUMB_SEAM(void, clear, "_ZN5plumb11clear_blockENS_15BasicMatrixViewIdEEmm",
           (MatrixView p, std::size_t at, std::size_t count));
PLUMB_SEAM(void, assign,
           "_ZN5plumb13assign_linearENS_15BasicMatrixViewIdEEmNS0_IKdEERKNS_11FixedVectorINS_7SegmentELm8EEE"
           "RKN5Eigen6MatrixIdLi3ELi3ELi0ELi3ELi3EEE",
           (MatrixView p, std::size_t at, ConstMatrixView jacobian, const Support& support, const Mat3& noise));
PLUMB_SEAM(void, propagate,
           "_ZN5plumb14propagate_coreENS_15BasicMatrixViewIdEERKN5Eigen6MatrixIdLi15ELi15ELi1ELi15ELi15EEES6_",
           (MatrixView p, const Mat15& phi, const Mat15& q));
PLUMB_SEAM(void, products,
           "_ZN5plumb12sum_productsENS_15BasicMatrixViewIKdEEPS1_RKNS_11FixedVectorINS_7SegmentELm8EEENS0_IdEE",
           (ConstMatrixView a, const double* row, const Support& support, MatrixView out));
PLUMB_SEAM(void, solve, "_ZN5plumb20solve_lower_in_placeENS_15BasicMatrixViewIKdEENS0_IdEE",
           (ConstMatrixView l, MatrixView b));
PLUMB_SEAM(void, gram, "_ZN5plumb13subtract_gramENS_15BasicMatrixViewIdEENS0_IKdEE", (MatrixView p, ConstMatrixView w));

namespace {

OperationRecorder& recorder() { return OperationRecorder::instance(); }

/// Records, with `tell` to fill in the operation, and then does it.
template <class Tell, class Do>
void pass_on(MatrixView p, Kind kind, Tell tell, Do perform) {
  const bool watched = recorder().watches(p);
  if (watched) {
    recorder().before(p);
    tell(recorder().add(kind, p.cols()));
  }
  perform();
  if (watched) recorder().after(p);
}

}  // namespace

void wrapped_clone(MatrixView p, std::size_t from, std::size_t to, std::size_t count) {
  pass_on(
      p, Kind::kClone, [&](Operation<double>& o) { o.from = from, o.at = to, o.count = count; },
      [&] { real_clone(p, from, to, count); });
}

void wrapped_move(MatrixView p, std::size_t from, std::size_t to, std::size_t count) {
  pass_on(
      p, Kind::kMove, [&](Operation<double>& o) { o.from = from, o.at = to, o.count = count; },
      [&] { real_move(p, from, to, count); });
}

void wrapped_clear(MatrixView p, std::size_t at, std::size_t count) {
  if (count == 0) return;  // of the calibration states that a configuration has not
  pass_on(
      p, Kind::kClear, [&](Operation<double>& o) { o.at = at, o.count = count; }, [&] { real_clear(p, at, count); });
}

void wrapped_assign(MatrixView p, std::size_t at, ConstMatrixView jacobian, const Support& support, const Mat3& noise) {
  const auto tell = [&](Operation<double>& o) {
    o.at = at;
    o.a = table(jacobian);
    o.b = noise;
    set_root(o, o.b);
    o.supports.assign(jacobian.rows(), support);
  };
  pass_on(p, Kind::kAssign, tell, [&] { real_assign(p, at, jacobian, support, noise); });
}

void wrapped_propagate(MatrixView p, const Mat15& phi, const Mat15& q) {
  pass_on(p, Kind::kPropagate, [&](Operation<double>& o) { o.a = phi, o.b = q; }, [&] { real_propagate(p, phi, q); });
}

void wrapped_products(ConstMatrixView a, const double* row, const Support& support, MatrixView out) {
  recorder().add_row(a, row, support);
  real_products(a, row, support, out);
}

void wrapped_solve(ConstMatrixView l, MatrixView b) {
  recorder().see_residual(b);
  real_solve(l, b);
}

void wrapped_gram(MatrixView p, ConstMatrixView w) {
  const bool watched = recorder().watches(p);
  if (watched) {
    recorder().before(p);
    recorder().add_update(p, w.rows());
  }
  real_gram(p, w);
  if (watched) recorder().after(p);
}

}  // namespace plumb::budget
