#include "test/budget/filter_forms/covariance_forms.h"

namespace plumb::budget {
namespace {

ConstMatrixView view(const Table<double>& table) {
  const auto rows = static_cast<std::size_t>(table.rows());
  const auto cols = static_cast<std::size_t>(table.cols());
  return {table.data(), rows, cols, cols};
}

}  // namespace

bool FlownForm::apply(const Operation<double>& operation) {
  size_ = operation.size;
  switch (operation.kind) {
    case Kind::kRestart: clear_block(p(), 0, size_); [[fallthrough]];
    case Kind::kPrior:
      for (Eigen::Index r = 0; r < operation.a.rows(); ++r) {
        std::copy_n(&operation.a(r, 0), operation.a.cols(),
                    p().row(operation.at + static_cast<std::size_t>(r)) + operation.at);
      }
      return true;
    case Kind::kClear: clear_block(p(), operation.at, operation.count); return true;
    case Kind::kClone: clone_block(p(), operation.from, operation.at, operation.count); return true;
    case Kind::kMove: move_block(p(), operation.from, operation.at, operation.count); return true;
    case Kind::kAssign:
      assign_linear(p(), operation.at, view(operation.a), operation.supports.front(), Mat3(operation.b));
      return true;
    case Kind::kPropagate: propagate_core(p(), Mat15(operation.a), Mat15(operation.b)); return true;
    case Kind::kUpdate: return update(operation);
  }
  return false;
}

bool FlownForm::update(const Operation<double>& operation) {
  const std::size_t rows = operation.residual.size();
  std::fill_n(correction_.begin(), size_, 0.0);
  const ConstMatrixView h = view(operation.a);
  const MatrixView w = scratch_->hp.view(rows, size_);
  std::size_t first = 0;
  for (const std::size_t count : operation.groups) {
    multiply_rows(h.block(first, 0, count, size_), operation.supports[first], p(), w.block(first, 0, count, size_));
    first += count;
  }
  const MatrixView s = scratch_->s.view(rows, rows);
  for (std::size_t j = 0; j < rows; ++j) {
    sum_products(w.block(j, 0, rows - j, size_), h.row(j), operation.supports[j],
                 MatrixView(&s(j, j), rows - j, 1, s.stride()));
    s(j, j) += 1.0;
  }
  if (!ok(cholesky_in_place(s))) return false;
  std::vector<double> y = operation.residual;
  solve_lower_in_place(s, w);
  solve_lower_in_place(s, MatrixView(y.data(), rows, 1, 1));
  for (std::size_t k = 0; k < rows; ++k) {
    const double* __restrict wk = w.row(k);
    for (std::size_t c = 0; c < size_; ++c) correction_[c] += y[k] * wk[c];
  }
  subtract_gram(p(), w);
  return true;
}

Table<long double> FlownForm::covariance() const {
  Table<long double> out(index(size_), index(size_));
  for (std::size_t r = 0; r < size_; ++r) {
    for (std::size_t c = 0; c < size_; ++c) out(index(r), index(c)) = p_.view()(r, c);
  }
  return out;
}

}  // namespace plumb::budget
