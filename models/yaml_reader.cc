#include "models/yaml_reader.h"

#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <sstream>

#include "base/angles.h"
#include "base/errors.h"
#include "base/number_from.h"

namespace evalbus {
namespace {

std::string Format(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

std::string Describe(NumberRange range) {
  const bool has_min = std::isfinite(range.min), has_max = std::isfinite(range.max);
  if (has_min && has_max) {
    return "a number in " + std::string(range.open_min ? "(" : "[") + Format(range.min) + ", " +
           Format(range.max) + "]";
  }
  if (has_min) return std::string("a number ") + (range.open_min ? "> " : ">= ") + Format(range.min);
  if (has_max) return "a number <= " + Format(range.max);
  return "a number";
}

bool IsName(std::string_view text) {
  const auto is_in_name = [](unsigned char c) { return std::isalnum(c) || c == '_'; };
  return !text.empty() && std::isalpha(static_cast<unsigned char>(text[0])) &&
         std::ranges::all_of(text, is_in_name);
}

// Parses all of `text` as a T; a plus sign is allowed.
template <typename T>
std::optional<T> Parse(std::string_view text) {
  return NumberFrom<T>(text.substr(text.size() > 1 && text[0] == '+' && text[1] != '-' ? 1 : 0));
}

// yaml-cpp also reads other encodings. They are rejected, because messages carry the text unchanged and end
// it with a NUL.
void CheckEncoding(const std::string& text, const std::string& file) {
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) {
    throw InputError(file + ":1: this is UTF-16; expected UTF-8 (iconv -f UTF-16 -t UTF-8)");
  }
  if (const size_t nul = text.find('\0'); nul != std::string::npos) {
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(nul), '\n');
    throw InputError(file + ":" + std::to_string(line) + ": a NUL byte; expected text in UTF-8");
  }
}

// Rejects documents that aliases make infinite or huge (`&a [*a]`), tags, and control characters such as NULs
// from escapes ("a\0b").
void CheckNode(const YAML::Node& node, const std::string& file, int depth, int* count) {
  const auto fail = [&](const char* what) {
    throw InputError(file + ":" + std::to_string(std::max(node.Mark().line, 0) + 1) + ": " + what);
  };
  if (depth > 50 || ++*count > 100000) fail("too deeply nested or too long");
  // Plain scalars, maps and lists have the tag "?", quoted scalars "!".
  if (node.Tag() != "" && node.Tag() != "?" && node.Tag() != "!")
    fail("a tag such as !!str is not supported");
  const auto is_control = [](unsigned char c) {
    return (c < 0x20 && c != '\t' && c != '\n' && c != '\r') || c == 0x7f;
  };
  if (node.IsScalar() && std::ranges::any_of(node.Scalar(), is_control))
    fail("the text contains a control character");
  for (const auto& entry : node) {
    if (node.IsMap()) {
      CheckNode(entry.first, file, depth + 1, count);
      CheckNode(entry.second, file, depth + 1, count);
    } else {
      CheckNode(entry, file, depth + 1, count);
    }
  }
}

class DocumentCounter : public YAML::EventHandler {
 public:
  int count() const { return count_; }

  void OnDocumentStart(const YAML::Mark&) override { ++count_; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {
  }
  void OnMapEnd() override {}

 private:
  int count_ = 0;
};

// Counts at most 2 documents. LoadAll() cannot be used, because yaml-cpp produces infinitely many documents
// from ", 1".
int CountDocuments(const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  DocumentCounter counter;
  while (counter.count() < 2 && parser.HandleNextDocument(counter)) {
  }
  return counter.count();
}

}  // namespace

YamlValue::YamlValue(const YAML::Node& node, std::string file, std::string key)
    : node_(node), file_(std::move(file)), key_(std::move(key)) {}

YamlValue& YamlValue::operator=(const YamlValue& other) {
  node_.reset(other.node_);
  file_ = other.file_;
  key_ = other.key_;
  key_line_ = other.key_line_;
  return *this;
}

SourceLocation YamlValue::location() const {
  const int line = key_line_ >= 0 ? key_line_ : node_.Mark().line;
  return {file_, std::max(line, 0) + 1};
}

std::string YamlValue::Where() const {
  return location().ToString() + ": " + (key_.empty() ? "" : "key '" + key_ + "': ");
}

void YamlValue::Fail(const std::string& message) const { throw InputError(OneLine(Where() + message)); }

std::string YamlValue::Shown() const {
  if (node_.IsScalar()) return "'" + node_.Scalar() + "'";
  if (node_.IsSequence()) return "a list";
  if (node_.IsMap()) return "a map";
  return "nothing";
}

std::string YamlValue::Text() const {
  if (!node_.IsScalar() || node_.Scalar().empty()) Fail("expected text, got " + Shown());
  return node_.Scalar();
}

std::string YamlValue::Name() const {
  const std::string text = node_.IsScalar() ? node_.Scalar() : "";
  if (!IsName(text)) Fail("expected a name of letters, digits and underscores, got " + Shown());
  return text;
}

const std::string& YamlValue::KeyName() const {
  if (!IsName(key_)) Fail("this key must be a name of letters, digits and underscores");
  return key_;
}

bool YamlValue::Bool() const {
  const std::string text = node_.IsScalar() ? node_.Scalar() : "";
  if (text != "true" && text != "false") Fail("expected true or false, got " + Shown());
  return text == "true";
}

bool YamlValue::is_number() const {
  // A quoted scalar has the tag "!".
  return node_.IsScalar() && node_.Tag() != "!" && Parse<double>(node_.Scalar());
}

double YamlValue::Number(NumberRange range) const {
  const auto value = is_number() ? Parse<double>(node_.Scalar()) : std::nullopt;
  const bool in_range = value && std::isfinite(*value) && *value <= range.max &&
                        (range.open_min ? *value > range.min : *value >= range.min);
  if (!in_range) Fail("expected " + Describe(range) + ", got " + Shown());
  return *value;
}

int YamlValue::Integer(int min, int max) const {
  const auto value = node_.IsScalar() && node_.Tag() != "!" ? Parse<int>(node_.Scalar()) : std::nullopt;
  if (!value || *value < min || *value > max) {
    const bool bounded = max != std::numeric_limits<int>::max();
    Fail("expected a whole number " +
         (bounded ? "from " + std::to_string(min) + " to " + std::to_string(max)
                  : ">= " + std::to_string(min)) +
         ", got " + Shown());
  }
  return *value;
}

int64_t YamlValue::Int64() const {
  const auto value = is_number() ? Parse<int64_t>(node_.Scalar()) : std::nullopt;
  if (!value) Fail("expected a whole number of at most 64 bits, got " + Shown());
  return *value;
}

std::vector<YamlValue> YamlValue::List() const {
  if (!node_.IsSequence()) Fail("expected a list, got " + Shown());
  std::vector<YamlValue> result;
  for (size_t i = 0; i < node_.size(); ++i) {
    const YAML::Node& element = node_;
    result.emplace_back(element[i], file_, key_ + "[" + std::to_string(i) + "]");
  }
  return result;
}

std::vector<std::string> YamlValue::Texts() const {
  std::vector<std::string> result;
  for (const YamlValue& element : List()) result.push_back(element.Text());
  return result;
}

std::vector<double> YamlValue::Numbers(size_t size, NumberRange range) const {
  if (!node_.IsSequence() || (size != 0 && node_.size() != size)) {
    Fail("expected a list of " + (size != 0 ? std::to_string(size) + " " : "") + "numbers, got " +
         (node_.IsSequence() ? std::to_string(node_.size()) : Shown()));
  }
  std::vector<double> result;
  for (const YamlValue& element : List()) result.push_back(element.Number(range));
  return result;
}

std::vector<YamlValue> YamlValue::Entries() const {
  if (!node_.IsMap()) Fail("expected a map, got " + Shown());
  std::vector<YamlValue> result;
  std::vector<YamlValue> merged;
  std::map<std::string, int> line_of;
  for (const auto& entry : node_) {
    YamlValue value(entry.second, file_, entry.first.IsScalar() ? entry.first.Scalar() : "");
    value.key_line_ = entry.first.Mark().line;
    if (value.key_.empty()) value.Fail("expected a key that is plain text");
    const auto [first, is_new] = line_of.emplace(value.key_, value.key_line_);
    if (!is_new) value.Fail("given twice, first in line " + std::to_string(first->second + 1));
    if (value.key_ == "<<") {
      merged = value.Entries();
    } else {
      result.push_back(value);
    }
  }
  // The map's own entries take precedence over entries merged from an anchor.
  for (const YamlValue& value : merged) {
    if (!line_of.contains(value.key())) result.push_back(value);
  }
  return result;
}

YamlMap::YamlMap(const YamlValue& value, const std::vector<const char*>& required,
                 const std::vector<const char*>& optional)
    : value_(value) {
  std::vector<std::string> known(required.begin(), required.end());
  known.insert(known.end(), optional.begin(), optional.end());
  for (const YamlValue& entry : value.Entries()) {
    if (std::find(known.begin(), known.end(), entry.key()) == known.end()) {
      entry.Fail("unknown key here" + Suggestion(entry.key(), known));
    }
    entries_.emplace(entry.key(), entry);
  }
  for (const char* key : required) {
    if (!entries_.contains(key)) {
      throw InputError(value.location().ToString() + ": key '" + key + "': required here, but missing" +
                       (value.key().empty() ? "" : " in '" + value.key() + "'"));
    }
  }
}

const YamlValue& YamlMap::operator[](const std::string& key) const& { return entries_.at(key); }

const YamlValue* YamlMap::Find(const std::string& key) const& {
  const auto found = entries_.find(key);
  return found == entries_.end() ? nullptr : &found->second;
}

std::optional<double> YamlMap::Angle(const std::string& stem, NumberRange range_deg) const {
  const YamlValue* deg = Find(stem + "_deg");
  const YamlValue* rad = Find(stem + "_rad");
  if (deg && rad) rad->Fail("give either this or '" + stem + "_deg'");
  if (deg) return deg->Number(range_deg) * kDegree;
  NumberRange range_rad = range_deg;
  range_rad.min *= kDegree;
  range_rad.max *= kDegree;
  if (rad) return rad->Number(range_rad);
  return std::nullopt;
}

namespace {

// Replaces some of the parser's texts by texts that name the missing bracket.
std::string YamlErrorText(const std::string& error) {
  if (error == "end of sequence flow not found") return "a '[' is not closed";
  if (error == "end of map flow not found") return "a '{' is not closed";
  return error;
}

}  // namespace

YamlValue ParseYaml(const std::string& text, const std::string& file) {
  CheckEncoding(text, file);
  try {
    if (const int documents = CountDocuments(text); documents != 1) {
      throw InputError(file + ":1: expected one YAML document, got " + std::to_string(documents));
    }
    const YAML::Node document = YAML::Load(text);
    int count = 0;
    CheckNode(document, file, 0, &count);
    return YamlValue(document, file, "");
  } catch (const YAML::Exception& error) {
    throw InputError(OneLine(file + ":" + std::to_string(error.mark.line + 1) +
                             ": not valid YAML: " + YamlErrorText(error.msg)));
  }
}

Pose ReadPose(const YamlValue& value, double farthest) {
  const YamlMap map(value, {"position_m"}, {"quaternion_wxyz", "yaw_deg", "yaw_rad"});
  Pose pose;
  pose.position = map["position_m"].Vector<3>({.min = -farthest, .max = farthest});
  const std::optional<double> yaw = map.Angle("yaw", {.min = -360, .max = 360});
  if (yaw) pose.quaternion = {std::cos(*yaw / 2), 0, 0, std::sin(*yaw / 2)};
  if (const YamlValue* quaternion = map.Find("quaternion_wxyz")) {
    if (yaw) quaternion->Fail("give either this or a yaw");
    pose.quaternion = quaternion->Vector<4>();
    double norm = 0;
    for (double x : pose.quaternion) norm += x * x;
    norm = std::sqrt(norm);
    std::string unit;
    for (double& x : pose.quaternion) {
      x /= norm;
      unit += (unit.empty() ? "" : ", ") + Format(x);
    }
    // Quaternions that are written with four digits are accepted. A larger deviation is a typing error, or
    // relies on MJCF's normalization.
    if (!(std::abs(norm - 1) <= 1e-3)) {
      quaternion->Fail("expected a unit quaternion, got norm " + Format(norm) +
                       (norm > 0 ? "; of norm 1 it is [" + unit + "]" : ""));
    }
  }
  return pose;
}

}  // namespace evalbus
