// Prints a hash over what the filter's arithmetic gives for inputs that are the same everywhere, one line per kernel.

#include <cinttypes>
#include <cstdio>

#include "fsw/base/hash.h"
#include "fsw/math/exact.h"
#include "fsw/math/kernels.h"
#include "fsw/math/strapdown.h"

namespace plumb {
namespace {

constexpr std::size_t kSize = 45;
using Storage = MatrixStorage<kSize, kSize>;

/// Numbers in [-1, 1) from a linear congruence (Knuth's MMIX), which needs no library.
class Numbers {
 public:
  double next() {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(static_cast<std::int64_t>(state_) >> 11) * 0x1.0p-52;
  }
  void fill(MatrixView m) {
    for (std::size_t r = 0; r < m.rows(); ++r) {
      for (std::size_t c = 0; c < m.cols(); ++c) m(r, c) = next();
    }
  }

 private:
  std::uint64_t state_ = 1;
};

void print(const char* name, const Hash64& hash) { std::printf("%s %016" PRIx64 "\n", name, hash.value()); }

void add(Hash64& hash, ConstMatrixView m) {
  for (std::size_t r = 0; r < m.rows(); ++r) hash.add(m.row(r), m.cols());
}

void functions(Numbers& numbers) {
  Hash64 hash;
  for (int i = 0; i < 10'000; ++i) {
    const double x = 10.0 * numbers.next();
    for (const double value : {exact::sin(x), exact::cos(x), exact::tan(x), exact::atan(x), exact::exp(x),
                               exact::log(x * x), exact::erfc(x * x), exact::atan2(x, numbers.next())}) {
      hash.add(value);
    }
  }
  print("functions", hash);
}

void matrices(Numbers& numbers) {
  static Storage a_storage;
  static Storage p_storage;
  const MatrixView a = a_storage.view();
  const MatrixView p = p_storage.view();
  numbers.fill(a);
  p_storage.clear();
  for (std::size_t i = 0; i < kSize; ++i) p(i, i) = 2.0 * kSize;
  subtract_gram(p, a);
  Hash64 hash;
  add(hash, p);
  const bool factored = ok(cholesky_in_place(p));
  solve_lower_in_place(p, a);
  add(hash, a);
  triangularise(a, kSize);
  add(hash, a);
  print(factored ? "matrices" : "matrices, not factored", hash);
}

void motion(Numbers& numbers) {
  const auto vector = [&numbers](double size) {
    const double x = numbers.next();
    const double y = numbers.next();
    return Vec3(size * x, size * y, size * numbers.next());
  };
  KinematicState state;
  Hash64 hash;
  for (int i = 0; i < 10'000; ++i) {
    const InertialRates from{vector(2.0), vector(10.0)};
    const InertialRates to{vector(2.0), vector(10.0)};
    strapdown_step(state, from, to, 0.005, 9.81);
    hash.add(state.q_WI.coeffs().data(), 4);
    hash.add(state.p_WI_m.data(), 3);
  }
  print("motion", hash);
}

}  // namespace
}  // namespace plumb

int main() {
  plumb::Numbers numbers;
  plumb::functions(numbers);
  plumb::matrices(numbers);
  plumb::motion(numbers);
  return 0;
}
