#include "config/yaml_file.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "config/input_error.h"

namespace plumb {

YamlFile::YamlFile(std::filesystem::path file) : file_(std::move(file)) {
  if (!std::filesystem::is_regular_file(file_)) {
    throw InputError(file_.string() + (std::filesystem::exists(file_) ? ": not a file" : ": not found") +
                     "; expected a YAML file");
  }
  load([this] { return YAML::LoadFile(file_.string()); });
}

YamlFile::YamlFile(const std::string& name, const std::string& text) : file_(name) {
  load([&text] { return YAML::Load(text); });
}

void YamlFile::load(const std::function<YAML::Node()>& read) {
  try {
    root_ = read();
  } catch (const YAML::Exception& error) {
    throw InputError(file_.string() + ": not readable as YAML: " + error.what());
  }
  if (!root_.IsMap()) throw InputError(file_.string() + ": expected a YAML map of keys and values");
  expect_plain_keys(root_, 0);
}

// The limit also ends a file that holds itself, which an alias can do.
void YamlFile::expect_plain_keys(const YAML::Node& node, int depth) const {
  constexpr int kDeepest = 32;
  const std::string line = file_.string() + " line " + std::to_string(node.Mark().line + 1);
  if (depth > kDeepest) throw InputError(line + ": expected at most " + std::to_string(kDeepest) + " levels of keys");
  if (!node.IsMap()) return;
  std::set<std::string> keys;
  for (const auto& entry : node) {
    if (!entry.first.IsScalar()) throw InputError(line + ": expected keys of one word");
    const std::string& key = entry.first.Scalar();
    if (!keys.insert(key).second) fail_at(entry.first.Mark().line, key, "stands here twice");
    expect_plain_keys(entry.second, depth + 1);
  }
}

std::optional<YAML::Node> YamlFile::find(const std::string& key) const {
  YAML::Node node = root_;
  asked_.insert(key.substr(0, key.find('.')));
  for (std::size_t start = 0; start <= key.size();) {
    const std::size_t dot = std::min(key.find('.', start), key.size());
    if (!node.IsMap()) return std::nullopt;
    const YAML::Node child = std::as_const(node)[key.substr(start, dot - start)];
    if (!child.IsDefined() || child.IsNull()) return std::nullopt;
    node.reset(child);
    start = dot + 1;
  }
  return node;
}

YamlFile YamlFile::section(const std::string& key) const {
  const YAML::Node node = require(key);
  if (!node.IsMap()) fail(key, "expected a map of keys and values");
  YamlFile section = *this;
  section.root_.reset(node);
  section.prefix_ = prefix_ + key + ".";
  section.asked_.clear();
  return section;
}

YAML::Node YamlFile::require(const std::string& key) const {
  const std::optional<YAML::Node> node = find(key);
  if (!node) throw InputError(file_.string() + ": key '" + prefix_ + key + "' is missing");
  return *node;
}

double YamlFile::to_number(const YAML::Node& node, const std::string& key) const {
  double value = 0.0;
  if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !std::isfinite(value)) {
    fail(key, "expected a finite number" + (node.IsScalar() ? ", found '" + node.Scalar() + "'" : std::string()));
  }
  return value;
}

double YamlFile::number(const std::string& key) const { return to_number(require(key), key); }

std::optional<double> YamlFile::optional_number(const std::string& key) const {
  const std::optional<YAML::Node> node = find(key);
  if (!node) return std::nullopt;
  return to_number(*node, key);
}

std::string YamlFile::word(const std::string& key) const {
  const YAML::Node node = require(key);
  if (!node.IsScalar()) fail(key, "expected one word");
  return node.Scalar();
}

std::string YamlFile::text(const std::string& key) const {
  const std::string found = word(key);
  if (found.empty()) fail(key, "expected one word, found none");
  return found;
}

std::string YamlFile::text_or(const std::string& key, const std::string& value) const {
  const std::string found = has(key) ? word(key) : std::string();
  return found.empty() ? value : found;
}

std::vector<double> YamlFile::numbers(const std::string& key, std::size_t count) const {
  const YAML::Node node = require(key);
  const bool right_size = node.IsSequence() && (count == 0 || node.size() == count);
  if (!right_size) {
    const std::string found = node.IsSequence() ? std::to_string(node.size()) : std::string("no list");
    fail(key, "expected a list of " + (count == 0 ? std::string() : std::to_string(count) + " ") + "numbers, found " +
                  found);
  }
  std::vector<double> values;
  for (const YAML::Node& item : node) values.push_back(to_number(item, key));
  return values;
}

std::vector<std::string> YamlFile::unused_keys(std::initializer_list<std::string_view> ignored) const {
  std::vector<std::string> sentences;
  for (const auto& entry : root_) {
    const std::string& key = entry.first.Scalar();
    if (asked_.contains(key) || std::find(ignored.begin(), ignored.end(), key) != ignored.end()) continue;
    sentences.push_back(file_.string() + " line " + std::to_string(entry.first.Mark().line + 1) + ": key '" + prefix_ + key +
                        "' is not known and has no effect");
  }
  return sentences;
}

std::vector<double> YamlFile::matrix(const std::string& key, std::size_t rows, std::size_t columns) const {
  const YAML::Node node = require(key);
  std::vector<double> values;
  bool right_size = node.IsSequence() && node.size() == rows;
  for (std::size_t r = 0; right_size && r < rows; ++r) {
    right_size = node[r].IsSequence() && node[r].size() == columns;
    for (std::size_t c = 0; right_size && c < columns; ++c) values.push_back(to_number(node[r][c], key));
  }
  if (!right_size) {
    fail(key, "expected " + std::to_string(rows) + " rows of " + std::to_string(columns) + " numbers");
  }
  return values;
}

void YamlFile::fail(const std::string& key, const std::string& message) const {
  const std::optional<YAML::Node> node = find(key);
  fail_at(node ? node->Mark().line : -1, key, message);
}

void YamlFile::fail_at(int line, const std::string& key, const std::string& message) const {
  const std::string where = line >= 0 ? " line " + std::to_string(line + 1) : std::string();
  throw InputError(file_.string() + where + ": key '" + prefix_ + key + "': " + message);
}

}  // namespace plumb
