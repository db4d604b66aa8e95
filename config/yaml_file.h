#pragma once
// A YAML file whose keys are required unless said otherwise. Every fault names the file, the line, the key, what was
// expected and what was found.

#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace plumb {

class YamlFile {
 public:
  /// Throws InputError when the file is missing, is not a YAML map, or has a key twice in one map. With `faults` keys
  /// that stand twice are added to it instead: of two maps both are read, of two values the first.
  explicit YamlFile(std::filesystem::path file, std::vector<std::string>* faults = nullptr);
  /// The same for the text of a file that was read before; `name` is what messages call it.
  YamlFile(const std::string& name, const std::string& text, std::vector<std::string>* faults = nullptr);

  /// The map under a key of this one, as a file of its own: its keys are named from there, its faults in full.
  YamlFile section(const std::string& key) const;
  bool has(const std::string& key) const { return find(key).has_value(); }
  double number(const std::string& key) const;
  std::optional<double> optional_number(const std::string& key) const;
  /// Not empty.
  std::string text(const std::string& key) const;
  /// The empty one is as good as no key.
  std::string text_or(const std::string& key, const std::string& value) const;
  /// A list of `count` finite numbers; any length when count is 0. `key` may be a path with dots ("T_BS.data").
  std::vector<double> numbers(const std::string& key, std::size_t count) const;
  /// A list of `rows` lists of `columns` finite numbers, one after the other.
  std::vector<double> matrix(const std::string& key, std::size_t rows, std::size_t columns) const;
  const YAML::Node& root() const { return root_; }
  std::string name() const { return file_.string(); }
  /// One sentence for each key of the outermost map that nobody asked for and that is not among `ignored`.
  std::vector<std::string> unused_keys(std::initializer_list<std::string_view> ignored) const;
  /// "FILE line N: key 'KEY': message, found VALUE"; without line and value where the key is missing.
  [[noreturn]] void fail(const std::string& key, const std::string& message) const;
  /// The same for the key's value, or one number of its list.
  [[noreturn]] void fail_at(const YAML::Node& value, const std::string& key, const std::string& message) const;

 private:
  void load(const std::function<YAML::Node()>& read, std::vector<std::string>* faults);
  YAML::Node with_plain_keys(const YAML::Node& map, const std::string& prefix, int depth,
                             std::vector<std::string>* faults) const;
  std::string line_of(const YAML::Node& node) const;
  std::optional<YAML::Node> find(const std::string& key) const;
  YAML::Node require(const std::string& key) const;
  std::string word(const std::string& key) const;
  double to_number(const YAML::Node& node, const std::string& key) const;

  std::filesystem::path file_;
  std::string prefix_;  ///< of the keys of a section, for messages
  YAML::Node root_;
  mutable std::set<std::string> asked_;  ///< outermost keys somebody wanted to know
};

}  // namespace plumb
