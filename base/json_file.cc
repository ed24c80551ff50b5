#include "base/json_file.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>
#include <streambuf>
#include <string>
#include <vector>

#include "base/errors.h"
#include "base/input_file.h"

namespace evalbus {
namespace {

// Name of the input in errors.
constexpr char kWhat[] = "JSON file";
// Files of evalbus nest less than ten levels; recursion over a hundred thousand would overflow the stack.
constexpr size_t kDeepest = 64;

// A file that the library reads character by character, and that take_text can look ahead in.
class LookAhead : public std::streambuf {
 public:
  explicit LookAhead(std::istream* file) : file_(file) {}

  // The next kAhead characters or more, or all remaining ones.
  std::string_view Text() {
    if (egptr() - gptr() < kAhead && *file_) Fill();
    return {gptr(), egptr()};
  }
  void Skip(size_t count) {
    gbump(static_cast<int>(count));
    skipped_ += count;
  }
  size_t skipped() const { return skipped_; }

 protected:
  int_type underflow() override {
    Fill();
    return gptr() == egptr() ? traits_type::eof() : traits_type::to_int_type(*gptr());
  }

 private:
  static constexpr std::ptrdiff_t kAhead = 1 << 17;

  void Fill() {
    buffer_.erase(0, gptr() - eback());
    const size_t kept = buffer_.size();
    buffer_.resize(2 * kAhead);
    file_->read(&buffer_[kept], static_cast<std::streamsize>(buffer_.size() - kept));
    buffer_.resize(kept + file_->gcount());
    setg(buffer_.data(), buffer_.data(), buffer_.data() + buffer_.size());
  }

  std::istream* file_;
  std::string buffer_;
  size_t skipped_ = 0;
};

// Names in an object. Most objects have few, for which no memory is allocated again per object.
class Names {
 public:
  void Clear() {
    num_first_ = 0;
    others_.clear();
  }
  // False if the name exists already.
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

// Builds the value and detects errors that the library accepts.
template <class Json>
class Builder : public nlohmann::detail::json_sax_dom_parser<Json> {
  using Base = nlohmann::detail::json_sax_dom_parser<Json>;

 public:
  explicit Builder(Json* json) : Base(*json, false), root_(json) {}
  Builder(Json* json, LookAhead* file, const std::string& key, const TakeElement& take,
          const TakeText& take_text)
      : Builder(json) {
    file_ = file;
    taken_key_ = key;
    take_ = take;
    take_text_ = take_text;
  }

  bool start_object(size_t size) { return Open() && Base::start_object(size); }
  bool start_array(size_t size) { return Open() && Base::start_array(size); }
  bool end_object() { return Close() && Base::end_object() && Offer(); }
  bool end_array() { return Close() && Base::end_array(); }
  bool key(std::string& name) {
    // The library would silently replace the first value.
    if (!names_[depth_ - 1].Add(name)) {
      what_ = name + ": expected each key once, it is repeated";
      return false;
    }
    if (depth_ == 1) outermost_key_ = name;
    return Base::key(name);
  }
  bool parse_error(size_t position, const std::string& token, const nlohmann::json::exception& error) {
    position_ = (position > 0 ? position - 1 : 0) + (file_ ? file_->skipped() : 0);
    // "[json.exception.parse_error.101] parse error at line 1, column 2: REASON"
    const std::string text = error.what();
    const size_t colon = text.find(": ");
    what_ = dynamic_cast<const nlohmann::json::out_of_range*>(&error)
                ? "expected JSON, the number " + token + " does not fit a double"
                : "expected JSON, " + (colon == std::string::npos ? text : text.substr(colon + 2));
    return false;
  }

  const std::string& what() const { return what_; }
  // Position of a syntax error; unknown for other errors.
  std::optional<size_t> position() const { return position_; }

 private:
  bool Open() {
    if (depth_ == kDeepest) {
      what_ = "expected JSON nested " + std::to_string(kDeepest) + " deep at most";
      return false;
    }
    if (names_.size() == depth_) names_.emplace_back();
    names_[depth_++].Clear();
    return true;
  }
  bool Close() {
    --depth_;
    return true;
  }

  // Called when an object is complete: it may be an element for take_. Once take_ has refused an element, all
  // later ones are stored, too.
  bool Offer() {
    if constexpr (std::is_same_v<Json, nlohmann::json>) {
      if (!take_ || depth_ != 2 || outermost_key_ != taken_key_) return true;
      auto* elements = (*root_)[taken_key_].template get_ptr<typename Json::array_t*>();
      if (!elements || elements->size() != 1) return true;
      if (!is_taken_ && !take_(*root_, elements->back())) return true;
      elements->pop_back();
      is_taken_ = take_text_ && TakeTexts();
    }
    return true;
  }

  // Lets take_text_ consume elements; true if it did. The library parses the last one itself, because its
  // error messages begin with the text that it read before.
  bool TakeTexts() {
    size_t end = 0;
    for (LastTaken last; (last = take_text_(file_->Text().substr(end))).end > 0;
         end = last.end - last.begin) {
      file_->Skip(end + last.begin);
    }
    return end > 0;
  }

  Json* root_;
  LookAhead* file_ = nullptr;
  std::string taken_key_;
  TakeElement take_;
  TakeText take_text_;
  bool is_taken_ = false;  // take_text_ has consumed the next element
  std::string outermost_key_;
  // Names in each open array or object; the first depth_ are in use.
  std::vector<Names> names_;
  size_t depth_ = 0;
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
                            const TakeElement& take, const TakeText& take_text) {
  std::ifstream stream = OpenInput(file, kWhat);
  LookAhead ahead(&stream);
  std::istream text(&ahead);
  nlohmann::json json;
  Builder<nlohmann::json> builder(&json, &ahead, key, take, take_text);
  if (nlohmann::json::sax_parse(text, &builder)) return json;
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
