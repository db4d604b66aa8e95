#pragma once
// A YAML file whose keys are required unless said otherwise. Every fault names the file, the key and what was expected.

#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace plumb::replay {

class YamlFile {
 public:
  /// Throws InputError when the file is missing, is not a YAML map, or has a key twice in one map.
  explicit YamlFile(std::filesystem::path file);

  double number(const std::string& key) const;
  std::optional<double> optional_number(const std::string& key) const;
  std::string text(const std::string& key) const;
  /// A list of `count` finite numbers; any length when count is 0. `key` may be a path with dots ("T_BS.data").
  std::vector<double> numbers(const std::string& key, std::size_t count) const;
  const YAML::Node& root() const { return root_; }
  /// One sentence for each key of the outermost map that nobody asked for and that is not among `ignored`.
  std::vector<std::string> unused_keys(std::initializer_list<std::string_view> ignored) const;
  /// "FILE line N: key 'KEY': message".
  [[noreturn]] void fail(const std::string& key, const std::string& message) const;
  /// The same for a line that is known, counted from 0 (-1: unknown).
  [[noreturn]] void fail_at(int line, const std::string& key, const std::string& message) const;

 private:
  void expect_plain_keys(const YAML::Node& node, int depth) const;
  std::optional<YAML::Node> find(const std::string& key) const;
  YAML::Node require(const std::string& key) const;
  double to_number(const YAML::Node& node, const std::string& key) const;

  std::filesystem::path file_;
  YAML::Node root_;
  mutable std::set<std::string> asked_;  ///< outermost keys somebody wanted to know
};

}  // namespace plumb::replay
