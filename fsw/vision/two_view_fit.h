#pragma once
// What the matches of two images say of how the camera turned and moved: costs of a direction, and the normal equations
// of a small rotation alone or with the direction of the translation. Matches are worked out several at a time, one to
// a lane. Sums go over every second match, those of costs over every fourth, on every machine, so that the width of its
// vectors does not show in the bits.

#include <array>
#include <cstddef>

namespace plumb::two_view {

inline constexpr double kEpipoleFloor = 1e-6;  // squared sine to the epipole under which a match says nothing

using Triple = std::array<double, 3>;

/// Unit vectors and what follows from them, one array per component. Precondition of all functions: in `previous` and
/// `current` what is beyond `count` is zero up to a multiple of kWhole, which agrees with everything.
struct Matches {
  static constexpr std::size_t kMost = 256;
  static constexpr std::size_t kWhole = 8;  ///< no vector unit has more lanes
  static_assert(kMost % kWhole == 0);
  using Components = std::array<std::array<double, kMost>, 3>;

  std::size_t count = 0;
  /// With what fills the last vector.
  std::size_t filled() const { return (count + kWhole - 1) / kWhole * kWhole; }

  Components previous{};   ///< b1 in C1
  Components current{};    ///< b2 in C2
  Components derotated{};  ///< b1' in C2
  Components flow{};       ///< b2 - b1'
  Components normal{};     ///< b1' x b2
  /// The last three again, for costs: each is rounded when it is small already, so that nothing is lost.
  using Singles = std::array<std::array<float, kMost>, 3>;
  Singles derotated_single{};
  Singles flow_single{};
  Singles normal_single{};
};

/// Sets derotated, flow and normal. `R_C2C1`: by rows.
void derotate(Matches& matches, const std::array<Triple, 3>& R_C2C1);

/// Sets what cost_of() reads, from what derotate() set.
void round_for_costs(Matches& matches);

struct Cost {
  float towards = 0.0F;
  float away = 0.0F;
};
/// Sum of the truncated squared distances to where points can move along `direction` (a unit vector in C2), and against
/// it [rad^2]. Once both reach `bound` it stops, and they are what they were then.
Cost cost_of(const Matches& matches, const Triple& direction, double threshold_rad, float bound);

/// Only the lower triangle of the information is there, column by column: [column][row].
template <std::size_t N>
struct NormalEquations {
  std::array<std::array<double, N>, N> information{};
  std::array<double, N> gradient{};
};

/// Of a small rotation d after q (w, x, y, z), from C1 to C2: Exp(d) b = b + d x b. `scale_rad`: of the robust weight.
NormalEquations<3> turn_equations(const Matches& matches, const std::array<double, 4>& q_C2C1, double scale_rad);

/// A direction in C2 and the plane in which it can move.
struct Tangent {
  Triple direction;
  Triple e1;
  Triple e2;
};
/// Of a small rotation after that of derotate(), and of steps along e1 and e2.
NormalEquations<5> move_equations(const Matches& matches, const Tangent& tangent, double scale_rad);

}  // namespace plumb::two_view
