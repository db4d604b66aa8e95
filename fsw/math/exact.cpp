#include "fsw/math/exact.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

namespace plumb::exact {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// pi/2 in three parts of which the first two have 33 bits: their products with a quadrant of up to 20 bits are exact.
constexpr double kHalfPi1 = 0x1.921fb544p+0;
constexpr double kHalfPi2 = 0x1.0b4611a6p-34;
constexpr double kHalfPi3 = 0x1.3198a2e037073p-69;
constexpr double kMaxAngle = 1e5;
// What the nearest double to pi/2 lacks.
constexpr double kHalfPi = 0.5 * std::numbers::pi;
constexpr double kHalfPiRest = 0x1.1a62633145c07p-54;

// ln 2: 32 bits, so that products with an exponent are exact, and the rest.
constexpr double kLn2High = 0x1.62e42feep-1;
constexpr double kLn2Low = 0x1.a39ef35793c76p-33;
constexpr double kMinExponent = -708.0;
constexpr double kMaxExponent = 709.0;

constexpr int kMantissaBits = 52;
constexpr int kExponentBias = 1023;

// c[0] + x (c[1] + x (...)).
template <std::size_t N>
constexpr double polynomial(const std::array<double, N>& c, double x) {
  double sum = c[N - 1];
  for (std::size_t i = N - 1; i-- > 0;) sum = sum * x + c[i];
  return sum;
}

// Taylor coefficients sign^i / (first + step i)!, which are less than half an ulp off in the ranges they are used in.
template <std::size_t N>
constexpr std::array<double, N> inverse_factorials(int first, int step, double sign) {
  std::array<double, N> c{};
  double signed_one = 1.0;
  for (std::size_t i = 0; i < N; ++i) {
    double factorial = 1.0;  // exact up to 22!
    for (int k = 2; k <= first + step * static_cast<int>(i); ++k) factorial *= k;
    c[i] = signed_one / factorial;
    signed_one *= sign;
  }
  return c;
}

// sign^i / (first + 2 i).
template <std::size_t N>
constexpr std::array<double, N> inverse_odds(int first, double sign) {
  std::array<double, N> c{};
  double signed_one = 1.0;
  for (std::size_t i = 0; i < N; ++i) {
    c[i] = signed_one / (first + 2 * static_cast<int>(i));
    signed_one *= sign;
  }
  return c;
}

// An angle as quadrant * pi/2 + rest, |rest| <= pi/4.
struct Reduced {
  unsigned quadrant;  ///< modulo 4
  double rest;
};

Reduced reduce(double x) {
  const double turns = std::floor(x * (2.0 * std::numbers::inv_pi) + 0.5);
  const double rest = ((x - turns * kHalfPi1) - turns * kHalfPi2) - turns * kHalfPi3;
  return {static_cast<unsigned>(static_cast<std::int32_t>(turns)) & 3U, rest};
}

double sin_of_rest(double x) {
  static constexpr auto kTaylor = inverse_factorials<8>(3, 2, -1.0);
  const double x2 = x * x;
  return x - x * x2 * polynomial(kTaylor, x2);
}

double cos_of_rest(double x) {
  static constexpr auto kTaylor = inverse_factorials<7>(4, 2, -1.0);
  const double x2 = x * x;
  const double half = 0.5 * x2;
  const double leading = 1.0 - half;
  return leading + (((1.0 - leading) - half) + x2 * x2 * polynomial(kTaylor, x2));
}

bool reducible(double x) { return std::abs(x) <= kMaxAngle; }  // false for not-a-number

// For 0 <= x <= 1, from the nearest of nine angles on.
double atan_of_unit(double x) {
  static constexpr std::array<double, 9> kAtanOfEighths{0.0,
                                                        0.12435499454676144,
                                                        0.24497866312686414,
                                                        0.35877067027057225,
                                                        0.4636476090008061,
                                                        0.5585993153435624,
                                                        0.6435011087932844,
                                                        0.7188299996216245,
                                                        0.7853981633974483};
  static constexpr auto kSeries = inverse_odds<7>(3, -1.0);
  const auto eighth = static_cast<std::size_t>(x * 8.0 + 0.5);
  const double near = 0.125 * static_cast<double>(eighth);
  const double rest = (x - near) / (1.0 + x * near);
  const double rest2 = rest * rest;
  return kAtanOfEighths[eighth] + (rest - rest * rest2 * polynomial(kSeries, rest2));
}

double with_sign_of(double sign, double magnitude) { return std::signbit(sign) ? -magnitude : magnitude; }

}  // namespace

double sin(double x) {
  if (!reducible(x)) return kNaN;
  const Reduced r = reduce(x);
  const double value = r.quadrant % 2 == 0 ? sin_of_rest(r.rest) : cos_of_rest(r.rest);
  return r.quadrant < 2 ? value : -value;
}

double cos(double x) {
  if (!reducible(x)) return kNaN;
  const Reduced r = reduce(x);
  const double value = r.quadrant % 2 == 0 ? cos_of_rest(r.rest) : sin_of_rest(r.rest);
  return r.quadrant == 0 || r.quadrant == 3 ? value : -value;
}

double tan(double x) {
  if (!reducible(x)) return kNaN;
  const Reduced r = reduce(x);
  const double s = sin_of_rest(r.rest);
  const double c = cos_of_rest(r.rest);
  return r.quadrant % 2 == 0 ? s / c : -c / s;
}

double atan(double x) {
  const double size = std::abs(x);
  if (!(size >= 0.0)) return x;
  const double angle = size <= 1.0 ? atan_of_unit(size) : kHalfPi - (atan_of_unit(1.0 / size) - kHalfPiRest);
  return with_sign_of(x, angle);
}

double atan2(double y, double x) {
  const double width = std::abs(x);
  const double height = std::abs(y);
  if (!(width >= 0.0) || !(height >= 0.0)) return kNaN;
  if (width == 0.0 && height == 0.0) return 0.0;
  double angle =
      height <= width ? atan_of_unit(height / width) : kHalfPi - (atan_of_unit(width / height) - kHalfPiRest);
  if (x < 0.0) angle = 2.0 * kHalfPi - (angle - 2.0 * kHalfPiRest);
  return with_sign_of(y, angle);
}

double exp(double x) {
  if (!(x >= kMinExponent)) return x < kMinExponent ? 0.0 : x;
  if (x > kMaxExponent) return kInfinity;
  static constexpr auto kTaylor = inverse_factorials<12>(2, 1, 1.0);
  const double doublings = std::floor(x * std::numbers::log2e + 0.5);
  const double rest = (x - doublings * kLn2High) - doublings * kLn2Low;
  const double value = 1.0 + (rest + rest * rest * polynomial(kTaylor, rest));
  // In two steps, because 2^1023 times 2 overflows and is not needed.
  const auto power = static_cast<std::int64_t>(doublings);
  const auto scale = [](std::int64_t e) { return std::bit_cast<double>((e + kExponentBias) << kMantissaBits); };
  return value * scale(power / 2) * scale(power - power / 2);
}

double log(double x) {
  if (!(x >= std::numeric_limits<double>::min()) || x > std::numeric_limits<double>::max()) return kNaN;
  const auto bits = std::bit_cast<std::int64_t>(x);
  std::int64_t power = (bits >> kMantissaBits) - kExponentBias;
  double mantissa = std::bit_cast<double>(bits - (power << kMantissaBits));
  if (mantissa > std::numbers::sqrt2) {
    mantissa *= 0.5;
    ++power;
  }
  // 2 atanh(s) with s = (m - 1) / (m + 1).
  static constexpr auto kSeries = inverse_odds<10>(3, 1.0);
  const double above = mantissa - 1.0;
  const double s = above / (2.0 + above);
  const double s2 = s * s;
  const double higher = 2.0 * s2 * polynomial(kSeries, s2);
  // 2 s = above - s above, whose first part is exact.
  const auto doublings = static_cast<double>(power);
  return doublings * kLn2High + (above - (s * (above - higher) - doublings * kLn2Low));
}

double erfc(double x) {
  constexpr double kSeriesEnd = 2.0;   // where the series, less than 1, still has 13 digits of the complement
  constexpr double kZero = 26.0;       // the result would lose bits
  constexpr int kSeriesTerms = 50;     // the last is below 1e-20
  constexpr int kFractionTerms = 100;  // at 2 the first left out is below 1e-16
  if (!(x < kZero)) return x >= kZero ? 0.0 : x;
  const double weight = exp(-x * x) * std::numbers::inv_sqrtpi;
  if (x < kSeriesEnd) {
    // erf x = 2 / sqrt(pi) exp(-x^2) (x + 2 x^3 / 3 + 4 x^5 / 15 + ...), all of one sign.
    double term = x;
    double sum = x;
    for (int n = 1; n <= kSeriesTerms; ++n) {
      term *= x * x / (n + 0.5);
      sum += term;
    }
    return 1.0 - 2.0 * weight * sum;
  }
  // exp(-x^2) / sqrt(pi) / (x + 1/2 / (x + 2/2 / (x + 3/2 / ...))).
  double tail = x;
  for (int n = kFractionTerms; n > 0; --n) tail = x + 0.5 * n / tail;
  return weight / tail;
}

double hypot(double a, double b) { return std::sqrt(a * a + b * b); }

}  // namespace plumb::exact
