#include "base/json_file.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>
#include <utility>
#include <vector>

#include "base/errors.h"
#include "base/input_file.h"

namespace evalbus {
namespace {

// Name of the input in errors.
constexpr char kWhat[] = "JSON file";
// Files of evalbus nest less than ten levels; recursion over a hundred thousand would overflow the stack.
constexpr size_t kDeepest = 64;

// The names in an object. Storage is reused, so that for most objects, which have few names, no memory is
// allocated.
class Names {
 public:
  void Clear() {
    num_first_ = 0;
    others_.clear();
  }
  // Returns false if the name exists already.
  bool Add(const std::string& name) {
    const auto end = first_.begin() + static_cast<std::ptrdiff_t>(num_first_);
    if (std::find(first_.begin(), end, name) != end) return false;
    if (num_first_ == first_.size()) return others_.insert(name).second;
    first_[num_first_++] = name;
    return true;
  }

 private:
  std::array<std::string, 64> first_;
  size_t num_first_ = 0;
  std::set<std::string> others_;
};

// Builds the value from the parser's events and detects errors that the library accepts.
template <class Json>
class Builder : public nlohmann::json_sax<Json> {
 public:
  explicit Builder(Json* root) : root_(root) {}
  Builder(Json* root, const std::string& taken_key, const TakeElement& take)
      : root_(root), taken_key_(taken_key), take_(take) {}

  bool null() override { return Add(nullptr); }
  bool boolean(bool value) override { return Add(value); }
  bool number_integer(int64_t value) override { return Add(value); }
  bool number_unsigned(uint64_t value) override { return Add(value); }
  bool number_float(double value, const std::string&) override { return Add(value); }
  bool string(std::string& value) override { return Add(std::move(value)); }
  bool binary(typename Json::binary_t& value) override { return Add(std::move(value)); }
  bool start_object(size_t) override { return Open(Json::object()); }
  bool start_array(size_t) override { return Open(Json::array()); }
  bool end_object() override {
    Close();
    Offer();
    return true;
  }
  bool end_array() override {
    Close();
    return true;
  }
  bool key(std::string& name) override {
    // For a repeated key, the library would silently replace the first value.
    if (!names_[open_.size() - 1].Add(name)) {
      what_ = name + ": repeated key, expected each key once";
      return false;
    }
    if (open_.size() == 1) outermost_key_ = name;
    key_ = std::move(name);
    return true;
  }
  bool parse_error(size_t position, const std::string& token,
                   const nlohmann::json::exception& error) override {
    position_ = position > 0 ? position - 1 : 0;
    // "[json.exception.parse_error.101] parse error at line 1, column 2: REASON"
    const std::string text = error.what();
    const size_t colon = text.find(": ");
    what_ = dynamic_cast<const nlohmann::json::out_of_range*>(&error)
                ? "expected JSON, the number " + token + " does not fit a double"
                : "expected JSON, " + (colon == std::string::npos ? text : text.substr(colon + 2));
    return false;
  }

  const std::string& what() const { return what_; }
  // Returns the position of an error that the parser reported; nullopt for a repeated key and for excessive
  // nesting.
  std::optional<size_t> position() const { return position_; }

 private:
  Json* Place(Json&& value) {
    if (open_.empty()) {
      *root_ = std::move(value);
      return root_;
    }
    Json& parent = *open_.back();
    if (parent.is_array()) {
      parent.push_back(std::move(value));
      return &parent.back();
    }
    return &(parent[key_] = std::move(value));
  }
  bool Add(Json value) {
    Place(std::move(value));
    return true;
  }
  bool Open(Json&& value) {
    if (open_.size() == kDeepest) {
      what_ = "expected JSON nested at most " + std::to_string(kDeepest) + " levels deep";
      return false;
    }
    open_.push_back(Place(std::move(value)));
    if (names_.size() < open_.size()) names_.emplace_back();
    names_[open_.size() - 1].Clear();
    return true;
  }
  void Close() { open_.pop_back(); }

  // Must be called when an object is complete, because it may be an element for take_. Once take_ has refused
  // an element, all later elements are also stored.
  void Offer() {
    if constexpr (std::is_same_v<Json, nlohmann::json>) {
      if (!take_ || open_.size() != 2 || outermost_key_ != taken_key_) return;
      auto* elements = (*root_)[taken_key_].template get_ptr<typename Json::array_t*>();
      if (elements && elements->size() == 1 && take_(*root_, elements->back())) elements->pop_back();
    }
  }

  Json* root_;
  std::string taken_key_;
  TakeElement take_;
  std::string outermost_key_;
  // Incomplete arrays and objects, from the outermost to the innermost. Only the innermost one grows, so the
  // addresses are stable.
  std::vector<Json*> open_;
  // Key of the next value, if the innermost of open_ is an object.
  std::string key_;
  // Names in each of open_. The vector is never shortened, so that its memory is reused.
  std::vector<Names> names_;
  std::string what_;
  std::optional<size_t> position_;
};

int LineOf(std::istream& text, size_t position) {
  int line = 1;
  for (char c; position > 0 && text.get(c); --position) line += c == '\n';
  return line;
}

}  // namespace

template <class Json>
Json ParseJson(const std::string& text, const std::string& file, int line) {
  Json json;
  Builder<Json> builder(&json);
  if (Json::sax_parse(text, &builder)) return json;
  if (const auto position = builder.position(); position && line == 0) {
    std::istringstream stream(text);
    line = LineOf(stream, *position);
  }
  const std::string where = line > 0 ? file + ":" + std::to_string(line) : file;
  throw InputError(where + ": " + builder.what());
}

template <class Json>
Json ReadJsonFile(const std::filesystem::path& file) {
  return ParseJson<Json>(ReadInput(file, kWhat), file.string());
}

nlohmann::json ReadJsonFile(const std::filesystem::path& file, const std::string& key,
                            const TakeElement& take) {
  std::ifstream stream = OpenInput(file, kWhat);
  nlohmann::json json;
  Builder<nlohmann::json> builder(&json, key, take);
  if (nlohmann::json::sax_parse(stream, &builder)) return json;
  const auto position = builder.position();
  std::ifstream again = OpenInput(file, kWhat);
  const std::string line = position ? ":" + std::to_string(LineOf(again, *position)) : "";
  throw InputError(file.string() + line + ": " + builder.what());
}

template nlohmann::json ParseJson(const std::string&, const std::string&, int);
template nlohmann::ordered_json ParseJson(const std::string&, const std::string&, int);
template nlohmann::json ReadJsonFile(const std::filesystem::path&);
template nlohmann::ordered_json ReadJsonFile(const std::filesystem::path&);

}  // namespace evalbus
