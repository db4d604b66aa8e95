#pragma once
// Records what the estimator does to its covariance while it flies, without a line in the flight software: the linker
// hands the calls of the covariance's functions over (--wrap, see CMakeLists.txt), and they are passed on unchanged.
// What the estimator writes into its covariance directly is found by comparing it with a copy.

#include <array>
#include <vector>

#include "fsw/math/matrix.h"
#include "test/budget/filter_forms/operation.h"

namespace plumb::budget {

class OperationRecorder {
 public:
  /// Of the program: the linker's seam knows no objects.
  static OperationRecorder& instance();

  /// The covariance to watch, of an estimator that outlives the recorder's use.
  void watch(const FilterState<FlightConfig>& filter) {
    filter_ = &filter;
    size_ = 0;
    operations_.clear();
  }
  bool watches(ConstMatrixView p) const { return filter_ != nullptr && p.data() == filter_->covariance().data(); }
  /// What was done since the last call. Call it between two calls of the estimator.
  std::vector<Operation<double>> take();

  // For the seam: before() first, then what is about to be done, then after().
  void before(ConstMatrixView p) { find_direct_writes(p); }
  void after(ConstMatrixView p);
  Operation<double>& add(Kind kind, std::size_t size);
  void add_row(ConstMatrixView products, const double* row, const Support& support);
  void see_residual(ConstMatrixView r);
  void add_update(ConstMatrixView p, std::size_t rows);

 private:
  void find_direct_writes(ConstMatrixView p);

  const FilterState<FlightConfig>* filter_ = nullptr;
  MatrixStorage<Layout::kSize, Layout::kSize> copy_;
  std::size_t size_ = 0;  // states in the copy; those beyond are not looked at, a new state begins with being cleared
  std::vector<Operation<double>> operations_;
  std::vector<std::vector<double>> rows_;  // seen by the update at hand, and their columns
  std::vector<Support> supports_;
  std::vector<double> residual_;
};

}  // namespace plumb::budget
