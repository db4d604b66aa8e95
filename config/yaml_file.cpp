#include "config/yaml_file.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <sstream>
#include <utility>

#include "config/input_error.h"

namespace plumb {
namespace {

/// On one line; of lists only the words. (An emitter of the library would cost the process 70 kB.)
std::string as_text(const YAML::Node& value) {
  if (value.IsScalar()) return "'" + value.Scalar() + "'";
  if (value.IsMap()) return "keys and values";
  std::string text = "[";
  for (const YAML::Node& item : value) {
    if (text.size() > 1) text += ", ";
    text += item.IsScalar() ? item.Scalar() : "...";
  }
  return text + "]";
}

void tell(std::vector<std::string>* faults, const std::string& fault) {
  if (faults == nullptr) throw InputError(fault);
  faults->push_back(fault);
}

YAML::Node both(const YAML::Node& first, const YAML::Node& second) {
  YAML::Node map(YAML::NodeType::Map);
  for (const YAML::Node& part : {first, second}) {
    for (const auto& entry : part) map.force_insert(entry.first, entry.second);
  }
  return map;
}

/// The line on which a second document begins, from 1; 0 without one. Told by the text: the library reads some broken
/// texts as documents without end.
int second_document(const std::string& text) {
  std::istringstream lines(text);
  bool begun = false;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const bool marker =
        line.starts_with("---") && (line.size() == 3 || std::isspace(static_cast<unsigned char>(line[3])) != 0);
    if (marker && begun) return number;
    const std::size_t first = line.find_first_not_of(" \t\r");
    begun = begun || marker || (first != std::string::npos && line[first] != '#' && line[first] != '%');
  }
  return 0;
}

}  // namespace

YamlFile::YamlFile(std::filesystem::path file, std::vector<std::string>* faults) : file_(std::move(file)) {
  if (!std::filesystem::is_regular_file(file_)) {
    throw InputError(file_.string() + (std::filesystem::exists(file_) ? ": not a file" : ": not found") +
                     "; expected a YAML file");
  }
  load([this] { return YAML::LoadFile(file_.string()); }, faults);
}

YamlFile::YamlFile(const std::string& name, const std::string& text, std::vector<std::string>* faults) : file_(name) {
  load([&text] { return YAML::Load(text); }, faults);
  if (const int line = second_document(text); line > 0) {
    tell(faults, file_.string() + " line " + std::to_string(line) + ": expected one document, found a second one");
  }
}

void YamlFile::load(const std::function<YAML::Node()>& read, std::vector<std::string>* faults) {
  try {
    root_ = read();
  } catch (const YAML::Exception& error) {
    throw InputError(file_.string() + ": not readable as YAML: " + error.what());
  }
  if (!root_.IsMap()) throw InputError(file_.string() + ": expected a YAML map of keys and values");
  root_.reset(with_plain_keys(root_, "", 0, faults));
}

std::string YamlFile::line_of(const YAML::Node& node) const {
  const int line = node.Mark().line;  // from 0, below that where nobody knows
  return file_.string() + (line >= 0 ? " line " + std::to_string(line + 1) : std::string());
}

// The limit also ends a file that holds itself, which an alias can do. A map without faults is returned as it is: one
// that is put together has no line.
YAML::Node YamlFile::with_plain_keys(const YAML::Node& map, const std::string& prefix, int depth,
                                     std::vector<std::string>* faults) const {
  constexpr int kDeepest = 32;
  if (depth > kDeepest) {
    throw InputError(line_of(map) + ": expected at most " + std::to_string(kDeepest) + " levels of keys");
  }
  std::vector<std::pair<YAML::Node, YAML::Node>> entries;
  bool changed = false;
  for (const auto& entry : map) {
    if (!entry.first.IsScalar()) {
      tell(faults, line_of(entry.first) + ": expected keys of one word, found " + as_text(entry.first));
      changed = true;
      continue;
    }
    const std::string& key = entry.first.Scalar();
    const auto same = std::find_if(entries.begin(), entries.end(),
                                   [&key](const auto& before) { return before.first.Scalar() == key; });
    if (same == entries.end()) {
      entries.emplace_back(entry.first, entry.second);
      continue;
    }
    auto& [first_key, first] = *same;
    tell(faults, line_of(entry.first) + ": key '" + prefix + key + "': stands on line " +
                     std::to_string(first_key.Mark().line + 1) + " already; expected once, found " +
                     as_text(entry.second));
    if (first.IsMap() && entry.second.IsMap()) first.reset(both(first, entry.second));
    changed = true;
  }
  YAML::Node plain(YAML::NodeType::Map);
  for (auto& [key, value] : entries) {
    // A key without a value is as none, which who wrote it may not have meant.
    if (value.IsNull() && faults != nullptr) {
      tell(faults,
           line_of(key) + ": key '" + prefix + key.Scalar() + "': expected a value, or no such key; found nothing");
    }
    if (value.IsMap()) {
      const YAML::Node inner = with_plain_keys(value, prefix + key.Scalar() + ".", depth + 1, faults);
      changed = changed || !inner.is(value);
      value.reset(inner);
    }
    plain.force_insert(key, value);
  }
  return changed ? plain : map;
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
    fail_at(node, key, "expected a finite number");
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
  if (found.empty()) fail(key, "expected one word");
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
    fail(key, "expected a list of " + (count == 0 ? std::string() : std::to_string(count) + " ") + "numbers");
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
    sentences.push_back(line_of(entry.first) + ": key '" + prefix_ + key + "' is not known and has no effect, found " +
                        as_text(entry.second));
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
  if (const std::optional<YAML::Node> node = find(key)) fail_at(*node, key, message);
  throw InputError(file_.string() + ": key '" + prefix_ + key + "': " + message);
}

void YamlFile::fail_at(const YAML::Node& value, const std::string& key, const std::string& message) const {
  throw InputError(line_of(value) + ": key '" + prefix_ + key + "': " + message + ", found " + as_text(value));
}

}  // namespace plumb
