#pragma once
// Where recorded flights are. They are large and not part of the repository: a test that needs them skips without them.
//
//   const auto folder = test::data_folder("euroc_mh01");
//   if (!folder) GTEST_SKIP() << test::kNoData;

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>

namespace plumb::test {

inline constexpr const char* kNoData = "recorded data not found; set PLUMB_DATA to the folder that holds it";

/// The folder `name` below $PLUMB_DATA, or below ../shared/data beside the repository; nothing when it is not there.
inline std::optional<std::filesystem::path> data_folder(const std::string& name) {
  const char* configured = std::getenv("PLUMB_DATA");
  const std::filesystem::path root = configured != nullptr && *configured != '\0'
                                         ? std::filesystem::path(configured)
                                         : std::filesystem::path(PLUMB_SOURCE_DIR) / ".." / "shared" / "data";
  std::error_code error;  // an unreadable folder is as good as none
  const std::filesystem::path folder = root / name;
  if (!std::filesystem::is_directory(folder, error)) return std::nullopt;
  return folder;
}

}  // namespace plumb::test
