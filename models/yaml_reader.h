// Strict reader for YAML. Every error is an InputError of one line:
//     lift_pot.yaml:12: key 'time_limit_s': expected a number > 0, got 'soon'
// Unknown and duplicate keys are errors. Anchors and aliases are supported, including `<<: *anchor` in a map.
#pragma once

#include <yaml-cpp/yaml.h>

#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/suggestion.h"
#include "models/farthest.h"
#include "models/pose.h"
#include "models/source_location.h"

namespace evalbus {

// Range of allowed values of a number. The number must always be finite.
struct NumberRange {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  // True if min itself is not allowed.
  bool open_min = false;
};
inline constexpr NumberRange kAnyNumber{};
inline constexpr NumberRange kPositive{.min = 0, .open_min = true};
inline constexpr NumberRange kNotNegative{.min = 0};

// A value of a file, with its key. A default-constructed value is null and has no file.
class YamlValue {
 public:
  YamlValue() = default;
  YamlValue(const YAML::Node& node, std::string file, std::string key);
  YamlValue(const YamlValue&) = default;
  // Rebinds to the other value. YAML::Node's own assignment would modify the document.
  YamlValue& operator=(const YamlValue& other);

  // Returns the location of the value or, if it has a key in a map, of its key; line 1 if the text is empty.
  SourceLocation location() const;
  const std::string& key() const { return key_; }
  bool is_scalar() const { return node_.IsScalar(); }
  bool is_list() const { return node_.IsSequence(); }
  bool is_map() const { return node_.IsMap(); }
  // Returns true for a number without quotes.
  bool is_number() const;

  // Returns a scalar that is not empty.
  std::string Text() const;
  // Returns a string of letters, digits and underscores that starts with a letter.
  std::string Name() const;
  // Returns the key, which must be such a name.
  const std::string& KeyName() const;
  bool Bool() const;
  double Number(NumberRange range = kAnyNumber) const;
  int Integer(int min, int max = std::numeric_limits<int>::max()) const;
  int64_t Int64() const;
  std::vector<YamlValue> List() const;
  std::vector<std::string> Texts() const;
  // Returns a list of numbers. size: required number of elements; 0: any.
  std::vector<double> Numbers(size_t size = 0, NumberRange range = kAnyNumber) const;
  template <size_t N>
  std::array<double, N> Vector(NumberRange range = kAnyNumber) const {
    std::array<double, N> result{};
    const std::vector<double> numbers = Numbers(N, range);
    for (size_t i = 0; i < N; ++i) result[i] = numbers[i];
    return result;
  }
  // Returns the values of a map's entries, with their keys, in file order; entries merged by `<<` come last.
  std::vector<YamlValue> Entries() const;

  // Returns "file:line: key 'k': ", the prefix of messages about the value.
  std::string Where() const;
  // Throws "file:line: key 'k': message".
  [[noreturn]] void Fail(const std::string& message) const;

 private:
  friend class YamlMap;
  std::string Shown() const;

  YAML::Node node_;
  std::string file_;
  std::string key_;
  // Line of the key in its map. -1: use the line of the value.
  int key_line_ = -1;
};

// A map with a fixed set of allowed keys.
class YamlMap {
 public:
  YamlMap(const YamlValue& value, const std::vector<const char*>& required,
          const std::vector<const char*>& optional = {});

  // Returns the value of a required key. On a temporary map, returns a copy.
  const YamlValue& operator[](const std::string& key) const&;
  YamlValue operator[](const std::string& key) && { return std::as_const(*this)[key]; }
  // Returns the value of an optional key; null if it is absent.
  const YamlValue* Find(const std::string& key) const&;
  const YamlValue* Find(const std::string& key) && = delete;
  // Returns an angle given as <stem>_deg or <stem>_rad, in rad. Both keys must be optional keys of this map.
  std::optional<double> Angle(const std::string& stem, NumberRange range_deg = kAnyNumber) const;
  const YamlValue& value() const { return value_; }

 private:
  YamlValue value_;
  std::map<std::string, YamlValue> entries_;
};

// Parses a whole document. `file` is only used in messages.
YamlValue ParseYaml(const std::string& text, const std::string& file);

// Reads {position_m: [x, y, z], and at most one of quaternion_wxyz, yaw_deg, yaw_rad}. farthest: limit of the
// position along each axis, m.
Pose ReadPose(const YamlValue& value, double farthest = kFarthestPart);

}  // namespace evalbus
