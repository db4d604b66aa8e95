#pragma once
// Run-time parameters as one table: each row names a member of a plain struct S and says its unit, range and meaning.
// The default is the member's own initialiser, read when the row is compiled, so that it stands in one place only.
// A bad value is refused and the old one stays. No heap, no state of its own.

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>

#include "fsw/base/crc32.h"
#include "fsw/base/status.h"

namespace plumb {

enum class ParamKind : std::uint8_t {
  kReal = 0,
  kInteger,  ///< values must be whole numbers
  kBoolean,  ///< 0 or 1
};

/// Whether a parameter may be changed while the software runs.
enum class ParamChange : std::uint8_t {
  kNever = 0,  ///< it shapes memory or work that is laid out once
  kAtStart,    ///< yes; it counts when the filter starts anew
  kInFlight,   ///< yes, at once
};

/// One parameter of the struct S. Every kind is carried as a double, which holds all of their values exactly.
template <class S>
struct ParamRow {
  std::string_view name;  ///< group.option
  std::string_view unit;  ///< "1" when there is none
  double min = 0.0;       ///< smallest and largest value accepted, both included
  double max = 0.0;
  double default_value = 0.0;
  std::string_view description;
  ParamKind kind = ParamKind::kReal;
  ParamChange change = ParamChange::kNever;
  double (*get)(const S&) = nullptr;
  void (*set)(S&, double) = nullptr;
};

namespace detail {

template <auto First, auto... Rest, class S>
constexpr auto& follow(S& object) {
  if constexpr (sizeof...(Rest) == 0) {
    return object.*First;
  } else {
    return follow<Rest...>(object.*First);
  }
}

// Not constexpr on purpose: reached while a row is compiled, it stops the build with its name in the message.
inline void parameter_default_is_outside_its_range() {}

template <class T>
constexpr ParamKind kind_of() {
  static_assert(std::is_same_v<T, double> || std::is_same_v<T, int> || std::is_same_v<T, bool>,
                "a parameter is a double, an int or a bool");
  if constexpr (std::is_same_v<T, bool>) return ParamKind::kBoolean;
  if constexpr (std::is_same_v<T, int>) return ParamKind::kInteger;
  return ParamKind::kReal;
}

}  // namespace detail

/// A row for the member reached from S through Path, a chain of pointers to members.
template <class S, auto... Path>
consteval ParamRow<S> param(std::string_view name, std::string_view unit, double min, double max,
                            std::string_view description, ParamChange change = ParamChange::kNever) {
  const S defaults{};
  using T = std::remove_cvref_t<decltype(detail::follow<Path...>(defaults))>;
  const auto value = static_cast<double>(detail::follow<Path...>(defaults));
  if (!(min <= value && value <= max)) detail::parameter_default_is_outside_its_range();
  return {.name = name,
          .unit = unit,
          .min = min,
          .max = max,
          .default_value = value,
          .description = description,
          .kind = detail::kind_of<T>(),
          .change = change,
          .get = [](const S& s) { return static_cast<double>(detail::follow<Path...>(s)); },
          .set = [](S& s, double v) { detail::follow<Path...>(s) = static_cast<T>(v); }};
}

template <class S>
constexpr bool param_names_unique(std::span<const ParamRow<S>> rows) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t k = i + 1; k < rows.size(); ++k) {
      if (rows[i].name == rows[k].name) return false;
    }
  }
  return true;
}

/// What became of one set(): kOk, or why not. `row` is null only when the name is unknown.
template <class S>
struct [[nodiscard]] ParamSetResult {
  Status status = Status::kOk;
  const ParamRow<S>* row = nullptr;
};

template <class S>
class ParamTable {
 public:
  /// `rows` must outlive the table.
  constexpr explicit ParamTable(std::span<const ParamRow<S>> rows) : rows_(rows) {}

  constexpr std::span<const ParamRow<S>> rows() const { return rows_; }

  constexpr const ParamRow<S>* find(std::string_view name) const {
    for (const ParamRow<S>& row : rows_) {
      if (row.name == name) return &row;
    }
    return nullptr;
  }

  /// CRC-32 of all names in their order, each with a zero after it: the number of a row means the same in two tables
  /// that agree in it.
  constexpr std::uint32_t crc() const {
    std::uint32_t crc = 0;
    for (const ParamRow<S>& row : rows_) {
      for (const char letter : row.name) crc = crc32(std::array{static_cast<std::uint8_t>(letter)}, crc);
      crc = crc32(std::array{std::uint8_t{0}}, crc);
    }
    return crc;
  }

  /// Writes one value. kInvalidValue, and nothing changed, for an unknown name, a value that is not finite or outside
  /// the range, and a fraction for a whole-number parameter.
  ParamSetResult<S> set(S& values, std::string_view name, double value) const {
    const ParamRow<S>* row = find(name);
    if (row == nullptr || !accepts(*row, value)) return {Status::kInvalidValue, row};
    row->set(values, value);
    return {Status::kOk, row};
  }

  static bool accepts(const ParamRow<S>& row, double value) {
    if (!std::isfinite(value) || value < row.min || value > row.max) return false;
    return row.kind == ParamKind::kReal || value == std::floor(value);
  }

 private:
  std::span<const ParamRow<S>> rows_;
};

}  // namespace plumb
